"""The actions of a campaign on files: tests as recordings in its folder, and their diagnosis."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from common.errors import InputError, InterlockError
from common.plan.plan import Plan
from common.plan.read import parse
from common.reality import reality as realities
from common.reality.reality import Reality
from common.recording.outcome import outcome
from common.recording.reader import read
from common.recording.run import Run
from common.roles import MASTER
from common.terminal import outputs
from common.terminal.telling import Tell, untold
from diagnosis.diagnose import diagnose
from diagnosis.findings.report import Judged
from diagnosis.recorded import record
from diagnosis.recorded.slips import refuse_slips
from simulation.campaign import assess, choice, strain
from simulation.campaign.goal import REAL_TIME, Goal, plan_of
from simulation.campaign.steps import (
    BegunStep,
    DecidedStep,
    DiagnosedStep,
    Endured,
    InterruptedStep,
    PlayedStep,
)
from simulation.workers.parts import synced
from simulation.workers.versions import versions

# Plays a test of a plan and number into a file; false where a person has to play it.
Play = Callable[[Plan, int, Path], bool]
Keep = Callable[
    [Path, Mapping[str, Judged]], None
]  # writes the reports by role of the slave into files of this name

UNFINISHED = ".rths-"  # begins the name of a file that is being written


class CampaignActions:
    """Plays and diagnoses the tests of a campaign in a folder."""

    def __init__(self, goal: Goal, folder: Path, play: Play, keep: Keep, tell: Tell = untold) -> None:
        self._goal, self._folder = goal, folder
        self._play, self._keep, self._tell = play, keep, tell

    def begin(self) -> BegunStep:
        """The candidates as the nominal models predict them."""
        return BegunStep(self._goal.digest, versions(), assess.nominal(self._goal))

    def plan(self, decided: DecidedStep) -> Plan:
        """The plan of a test."""
        return plan_of(self._goal, decided.candidate, decided.test)

    def interrupted(self, decided: DecidedStep) -> Sequence[InterruptedStep]:
        """The recordings of a test in real time whose program was ended; each gets a name by which it is kept.

        In virtual time there are none, because the same test gives the same recording again.
        """
        half = self.half(decided.test)
        if self._goal.head.mode == REAL_TIME and half.is_file() and half.stat().st_size:
            count = len(list(self._folder.glob(f"{name(decided.test)}-interrupted-*.mcap")))
            half.rename(self._folder / f"{name(decided.test)}-interrupted-{count + 1}.mcap")
        found = sorted(self._folder.glob(f"{name(decided.test)}-interrupted-*.mcap"))
        plan = self.plan(decided)
        return [InterruptedStep(decided.test, path.name, *strain.of_run(plan, read(path))) for path in found]

    def half(self, test: int) -> Path:
        """The file of a test that has not reached its end."""
        return self._folder / f"{UNFINISHED}{name(test)}.mcap"

    def play(self, decided: DecidedStep) -> PlayedStep | None:
        """Play a test, unless its recording is there already."""
        path, plan = self._folder / f"{name(decided.test)}.mcap", self.plan(decided)
        outputs.write_text(path.with_suffix(".toml"), plan.toml(), force=True)
        if not path.exists():
            half = self.half(decided.test)
            half.unlink(missing_ok=True)
            if not self._play(plan, decided.test, half):
                return None
            finished(half, path)
        run = read(path)
        refuse_other(plan, run)
        ended = outcome(run.metadata.get("summary", {}))
        return PlayedStep(decided.test, path.name, *strain.of_run(plan, run), digest_of(path), ended)

    def diagnose(self, played: Sequence[PlayedStep], endured: Endured) -> DiagnosedStep:
        """Diagnose all tests together, the one with the largest drift first, whose gap stands out most."""
        order = sorted(played, key=lambda one: (-one.drift, one.test))
        for one in order:
            refuse_changed(self._folder / one.file, one.digest)
        runs = [read(self._folder / one.file) for one in order]
        test = played[-1].test
        judged = together(runs, self._goal.head.gap or None, self._tell)
        path = self._folder / f"diagnosis-{test:02d}.json"
        self._keep(path, judged)
        reports = [one.report for one in judged.values()]
        known = assess.knowledge({role: one.found for role, one in judged.items()})
        causes = known.causes()[: assess.LISTED]
        said = DiagnosedStep(
            test,
            path.name,
            versions(),
            ", ".join(one.status for one in reports),
            max((part.left or 0.0 for report in reports for part in report.parts), default=0.0),
            causes,
            (causes[0].effects,),
            causes[0].probability,
            (),
        )
        if choice.end(self._goal.head, said):
            return said
        self._tell("the next test", 0, 0)
        more = assess.assessed(self._goal, known, test + 1, endured)
        return replace(said, **more._asdict())


def name(test: int) -> str:
    """The stem of a test's files."""
    return f"test-{test:02d}"


def finished(half: Path, path: Path) -> None:
    """Give a recording its name once it is on the disk as a whole."""
    synced(half)
    half.replace(path)
    synced(path.parent)


def together(runs: Sequence[Run], require: float | None, tell: Tell = untold) -> dict[str, Judged]:
    """The reports on recordings of the same laboratories, by role of the slave; one cause must explain all."""
    own, *more = ({role: record.build(run, role=role) for role in run.roles or (MASTER,)} for run in runs)
    for records in (own, *more):
        for one in records.values():
            refuse_slips(one, one.run.path)
    others = {role: [records[role] for records in more] for role in own}
    return diagnose(own, {}, tell, require, others)


def digest_of(path: Path) -> str:
    """Sixteen hex digits of a file."""
    return hashlib.blake2b(path.read_bytes(), digest_size=8).hexdigest()


def refuse_changed(path: Path, digest: str) -> None:
    """Raise InputError where a recording is not there any more, or is another one."""
    if not path.is_file() or digest_of(path) != digest:
        raise InputError(
            f"{path} is not the recording that the campaign's log has: put it back, or begin anew in another folder "
            "with -o."
        )


def refuse_other(plan: Plan, run: Run) -> None:
    """Raise InputError where a recording is not of the test of a plan."""
    if "plan" not in run.metadata:
        raise InputError(f"{run.path} carries no plan: give a recording that rths made, or rths import.")
    given = parse(run.metadata["plan"]["toml"], run.path.parent)
    tables = (
        ("ground_motion", "record"),
        ("ground_motion", "scale"),
        ("control", "amd"),
        ("test", "interval"),
    )
    for table, key in tables:
        wanted, there = (getattr(getattr(one, table), key) for one in (plan, given))
        if wanted != there:
            raise InputError(
                f"{run.path} is not of the test that is next: {key} in [{table}] is {there!r} there, but {wanted!r} in "
                f"{plan.test.name}; play the plan that lies beside the log."
            )


def take(recording: Path, decided: DecidedStep, folder: Path, plan: Plan) -> None:
    """Copy a recording that a person made of a test into the campaign's folder.

    Raises:
        InputError: it cannot be read, or is not of that test.
    """
    refuse_other(plan, read(recording))
    half = folder / f"{UNFINISHED}{name(decided.test)}.copy"
    try:
        shutil.copyfile(recording, half)
    except OSError as error:
        raise InputError(f"Cannot copy {recording} into {folder}: {error.strerror}.") from None
    finished(half, folder / f"{name(decided.test)}.mcap")


def tidied(folder: Path) -> None:
    """Remove what an earlier command was writing when it was ended; recordings of tests aside."""
    for path in folder.glob(f"{UNFINISHED}*"):
        if path.suffix != ".mcap":
            path.unlink()


def virtually(reality: Callable[[Plan, int], Reality]) -> Play:
    """Plays tests in virtual time in the laboratories of a reality by plan and number of the test."""

    def play(plan: Plan, test: int, path: Path) -> bool:
        from simulation import virtual

        ended = virtual.run(virtual.assemble(plan, reality(plan, test), path), str)
        if ended is not None and not isinstance(ended, InterlockError):
            raise ended
        return True

    return play


def of_file(path: Path | None, seed: int) -> Callable[[Plan, int], Reality]:
    """The laboratories of a reality's file, or as planned; each test has a draw of the noise of its own."""

    def reality(plan: Plan, test: int) -> Reality:
        found = realities.load(path, plan) if path else realities.as_planned(plan)
        return replace(found, seed=found.seed + seed + test - 1)

    return reality
