"""A campaign that is killed at any step continues without losing or repeating a step."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import InputError
from common.plan.plan import Plan
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import rows
from recorder import files
from simulation.campaign import actions, choice, course, goal, log, steps
from simulation.campaign.goal import Goal
from simulation.campaign.steps import (
    DecidedStep,
    DiagnosedStep,
    Endured,
    Option,
    PlayedStep,
    PossibleCause,
    Step,
)


class KilledError(BaseException):
    """The command is killed here."""


class Killer:
    """Kills a command after it has passed this many places."""

    def __init__(self, after: int | None = None) -> None:
        self.left = after
        self.passed = 0

    def __call__(self) -> None:
        self.passed += 1
        if self.left is not None and self.passed > self.left:
            raise KilledError

    def told(self, _step: Step) -> None:
        self()


class StandIn(actions.CampaignActions):
    """Real files, with a diagnosis that grows surer with every test."""

    killer: Killer

    def diagnose(self, played: Sequence[PlayedStep], endured: Endured) -> DiagnosedStep:
        self.killer()
        path = self._folder / f"diagnosis-{len(played):02d}.json"
        path.write_text(f"{[one.digest for one in played]} {endured.drift}")
        self.killer()
        sure = 0.4 + 0.2 * len(played)
        options = tuple(Option(one, 1e-3 * one, 0.0, "", 1.0 / one) for one in (1, 2, 3))
        causes = (PossibleCause(("a",), sure), PossibleCause(("b",), 1.0 - sure))
        return DiagnosedStep(len(played), path.name, "", "ambiguous", 0.1, causes, (("a",),), sure, options)


@cache
def campaign() -> Goal:
    return goal.from_tables({"candidate": [{"scales": [0.01, 0.02, 0.03], "durations": 0.1}]}, Path())


@cache
def recording(plan: str) -> bytes:
    """The simulation of a plan as a recording; the same bytes each time."""
    number = int(plan.rpartition("-")[2])
    one = next(
        each
        for each in (goal.plan_of(campaign(), candidate, number) for candidate in (1, 2, 3))
        if f"{each.ground_motion.scale}:{each.test.name}" == plan
    )
    motion = substructure.motion(one)
    ground = substructure.ground_rows(one, motion)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "test.mcap"
        file = files.begin(path, one, (motion, ground))
        for topic, values in rows(one, simulate(one, ground)):
            file.add(topic, one.tick_ns(values[0]), one.tick_ns(values[0]), values)
        file.close({"outcome": "stop", "cause": "completed"})
        return path.read_bytes()


def work(folder: Path, killer: Killer, plays: list[int]) -> StandIn:
    def play(plan: Plan, test: int, path: Path) -> bool:
        assert not path.exists()
        whole = recording(f"{plan.ground_motion.scale}:{plan.test.name}")
        path.write_bytes(whole[: len(whole) // 2])
        killer()
        path.write_bytes(whole)
        plays.append(test)
        killer()
        return True

    found = StandIn(campaign(), folder, play, lambda _path, _judged: None)
    found.killer = killer
    return found


def go(
    folder: Path, killer: Killer, plays: list[int], tell: Callable[[Step], None] = lambda _: None
) -> bytes:
    with log.opened(folder) as kept:
        course.check(kept.steps, campaign().digest)
        actions.tidied(folder)
        head = campaign().head
        course.go_on(kept, work(folder, killer, plays), choice.choosing(head), tell)
    return (folder / log.LOG).read_bytes()


@cache
def uninterrupted() -> tuple[bytes, int]:
    """The log of a campaign that is not killed, and the number of places that it passes."""
    with tempfile.TemporaryDirectory() as folder:
        killer, plays = Killer(), list[int]()
        found = go(Path(folder), killer, plays, killer.told)
        assert plays == [1, 2, 3]
        return found, killer.passed


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 20), st.floats(0.0, 1.0)), max_size=3))
def test_a_campaign_continues_from_any_point_at_which_it_was_killed(kills: list[tuple[int, float]]) -> None:
    whole, places = uninterrupted()
    with tempfile.TemporaryDirectory() as name:
        folder, plays = Path(name), list[int]()
        for after, share in kills:
            killer = Killer(after % places)
            try:
                go(folder, killer, plays, killer.told)
            except KilledError:
                torn(folder / log.LOG, whole, share)
        assert go(folder, Killer(), plays) == whole
        assert {one.name for one in folder.glob("test-*.mcap")} == {
            f"test-{test:02d}.mcap" for test in (1, 2, 3)
        }
        assert not list(folder.glob(".*"))
        # a test is played again only where the command was killed before its recording had its name
        assert len(plays) - len(set(plays)) <= len(kills)


def torn(path: Path, whole: bytes, share: float) -> None:
    """Append a part of the next line, as after a kill in the middle of writing."""
    there = path.read_bytes()
    assert whole.startswith(there)
    line = whole[len(there) :].partition(b"\n")[0]
    path.write_bytes(there + line[: int(share * len(line))])


def test_a_test_whose_recording_exists_is_not_played_again(tmp_path: Path) -> None:
    plays: list[int] = []
    with pytest.raises(KilledError):
        go(tmp_path, Killer(2), plays)  # in the diagnosis of the first test
    text = (tmp_path / log.LOG).read_bytes().splitlines(keepends=True)
    (tmp_path / log.LOG).write_bytes(b"".join(text[:2]))  # as if killed between renaming and logging
    assert go(tmp_path, Killer(), plays) == uninterrupted()[0]
    assert plays == [1, 2, 3]


def test_a_damaged_log_is_refused_and_its_line_is_named(tmp_path: Path) -> None:
    (tmp_path / log.LOG).write_bytes(uninterrupted()[0].replace(b'"played"', b'"layed"', 1))
    with pytest.raises(InputError, match="Line 3 of .* is damaged"):
        go(tmp_path, Killer(), [])


def test_a_recording_that_was_changed_after_its_test_is_refused(tmp_path: Path) -> None:
    (tmp_path / "test-01.mcap").write_bytes(b"other")
    actions.refuse_changed(tmp_path / "test-01.mcap", actions.digest_of(tmp_path / "test-01.mcap"))
    for name in ("test-01.mcap", "test-02.mcap"):
        with pytest.raises(InputError, match=f"{name} is not the recording that the campaign's log has"):
            actions.refuse_changed(tmp_path / name, "0" * 16)


def test_a_log_of_another_campaign_is_refused(tmp_path: Path) -> None:
    text = uninterrupted()[0].replace(campaign().digest.encode(), b"0" * 16, 1)
    (tmp_path / log.LOG).write_bytes(text)
    with pytest.raises(InputError, match="The folder holds a campaign with another plan"):
        go(tmp_path, Killer(), [])


def test_a_second_command_on_the_same_campaign_is_refused(tmp_path: Path) -> None:
    with log.opened(tmp_path), pytest.raises(InputError, match="Another process is at work"):
        go(tmp_path, Killer(), [])


def test_a_campaign_played_by_hand_waits_for_each_recording_and_continues_with_it(tmp_path: Path) -> None:
    found = StandIn(campaign(), tmp_path, lambda _plan, _test, _path: False, lambda _path, _judged: None)
    found.killer = Killer()
    with log.opened(tmp_path) as kept:
        waiting = course.go_on(kept, found, choice.choosing(campaign().head))
        assert isinstance(waiting, DecidedStep)
        plan = found.plan(waiting)
        assert (tmp_path / "test-01.toml").read_text() == plan.toml()
        own = tmp_path / "mine.mcap"
        own.write_bytes(recording(f"{plan.ground_motion.scale}:{plan.test.name}"))
        actions.take(own, waiting, tmp_path, plan)
        again = course.go_on(kept, found, choice.choosing(campaign().head))
        assert isinstance(again, DecidedStep)
        assert again.test == 2
        with pytest.raises(
            InputError, match=r"is not of the test that is next: scale in \[ground_motion\] is 0.03"
        ):
            actions.take(own, again, tmp_path, found.plan(again))


def test_every_step_of_the_log_is_read_as_it_was_written() -> None:
    for one in uninterrupted()[0].splitlines():
        assert steps.line(steps.parsed(one)) == one + b"\n"
    cut = steps.InterruptedStep(1, "test-01-interrupted-1.mcap", 0.001, 0.0)
    assert steps.parsed(steps.line(cut)) == cut


def test_an_interrupted_test_in_real_time_is_kept_and_counts(tmp_path: Path) -> None:
    own = goal.from_tables(
        {"mode": "real time", "candidate": [{"scales": [0.01, 0.02, 0.03], "durations": 0.1}]}, Path()
    )
    plan = goal.plan_of(campaign(), 1, 1)
    whole = recording(f"{plan.ground_motion.scale}:{plan.test.name}")

    def play(_plan: Plan, _test: int, path: Path) -> bool:
        path.write_bytes(whole)
        raise KilledError

    found = StandIn(own, tmp_path, play, lambda _path, _judged: None)
    found.killer = Killer()
    for count in (1, 2):
        with log.opened(tmp_path) as kept, pytest.raises(KilledError):
            course.go_on(kept, found, choice.choosing(own.head))
        assert len(list(tmp_path.glob("test-01-interrupted-*.mcap"))) == count - 1
    with log.opened(tmp_path) as kept:
        cut = course.of(kept.steps, steps.InterruptedStep)
        assert [one.file for one in cut] == ["test-01-interrupted-1.mcap"]
        assert course.endured(kept.steps).drift == cut[0].drift > 0.0
