"""`rths replay`: the computed signals of a recording computed again from its measurements."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.roles import MASTER, SLAVE, latency_topic, title
from common.terminal import cli
from common.terminal.printable import shown
from common.terminal.telling import Tell, untold
from report.text.progress import Progress

if TYPE_CHECKING:
    from common.plan.plan import Plan
    from common.recording.run import Run
    from master.building import Outputs
    from master.step import MasterStep

NOWHERE = (0.0, 0.0)  # position and force where the master has no laboratory


@dataclass
class Match:
    """How one computed signal compares with the recorded one: ticks compared, and where they first differ."""

    compared: int = 0
    differing: int = 0
    first: float | None = None
    largest: float = 0.0

    def take(self, t: float, computed: Any, recorded: Any) -> None:
        """Compare one value, or one per storey."""
        import numpy as np

        self.compared += 1
        if not np.array_equal(computed, recorded):
            self.differing += 1
            self.first = t if self.first is None else self.first
            self.largest = max(self.largest, float(np.max(np.abs(np.subtract(computed, recorded)))))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `replay`."""
    cli.recording_argument(parser)
    parser.add_argument(
        "--plan",
        metavar="PLAN",
        help="a plan file in whose folder the files of your own kinds of laboratory are (default: the folder of FILE)",
    )
    cli.json_argument(parser, "write the result as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Replay; 1 where a computed signal differs from the recorded one."""
    with Progress("replaying") as progress:
        from common.recording.reader import read

        recording = read(args.file)
        plan = planned(recording, args.plan)
        matches = replay_master(recording, plan, progress.tell) | replay_slaves(
            recording, plan, progress.tell
        )
    if not any(match.compared for match in matches.values()):
        raise InputError(f"{args.file} cannot be replayed: it holds no signal that rths computes.")
    result = {name: vars(match) for name, match in matches.items()}
    same = all(match.differing == 0 for match in matches.values())
    if args.json:
        sys.stdout.write(json.dumps({"matches": same, "signals": result}) + "\n")
    else:
        motion = recording.metadata.get("ground_motion", {})
        line = f"ground motion: {motion.get('record')}, scaled by {motion.get('scale')}"
        sys.stdout.write(f"{shown(line)}\n\n")
        show(matches, same)
    return 0 if same else 1


def planned(recording: Run, place: str | None = None) -> Plan:
    """The whole plan in a recording; files of users' kinds are beside the recording, or beside the plan at `place`.

    Raises:
        InputError: the recording was imported, holds no plan or one that cannot be read, or lacks what the master used.
    """
    from common.recording.imported import imported
    from report.facts.laboratories import whole_plan

    if imported(recording) is not None:
        raise InputError(
            f"{recording.path} cannot be replayed: it was imported, so that rths did not compute its signals."
        )
    plan = whole_plan(recording)
    if plan is None or not recording.has(MASTER):
        raise InputError(f"{recording.path} cannot be replayed: it lacks the plan or the master's signals.")
    if place is not None:
        file = cli.plan_path(place)
        if not file.is_file():
            raise InputError(f"There is no plan {file}: give the path of a TOML file.")
        plan = replace(plan, base=file.parent)
    if lacking := [name for name in inputs(plan) if name not in recording.columns[MASTER]]:
        raise InputError(
            f"{recording.path} cannot be replayed: its master's signals lack {', '.join(lacking)}."
        )
    return plan


def inputs(plan: Plan) -> list[str]:
    """The master's signals from which those that it computes follow."""
    from laboratories import kinds

    own = kinds.own(plan)
    felt = [own.channels.position, own.channels.force] if own else []
    used = [kinds.kind_of(plan, role).channels.used for role in plan.roles]
    return ["seq", "t", *felt, *dict.fromkeys(used)]


def replay_master(recording: Run, plan: Plan, tell: Tell = untold) -> dict[str, Match]:
    """The building and the commands to all laboratories, from the first tick to the first that is missing."""
    import numpy as np

    from common.recording.holds import holds
    from laboratories import kinds
    from master.step import MasterStep

    recorded = recording.columns[MASTER]
    columns = {name: values.tolist() for name, values in recorded.items()}
    step, host = MasterStep(plan, ground_of(recording)), kinds.own(plan)
    own = host.channels if host else None
    felt = [columns[name] for name in (own.position, own.force)] if own else []
    used, names = forces_used(plan, columns), ComputedSignals(plan)
    held = held_ticks(recording, columns.get(own.command.name, []) if own else [])
    matches: dict[str, Match] = {}
    there = [name for name in names.held if name in recorded]
    command: dict[str, Any] = {name: np.zeros(recorded[name].shape[1:]) for name in there}
    ordered = {hold.begun: hold.resumed for hold in holds(recording.events, plan.test.interval)}
    for tick, seq in enumerate(columns["seq"]):
        if seq != tick:
            break
        if tick in ordered:
            hold(step, tick, ordered[tick])
        tell("the master's ticks", tick, len(columns["seq"]))
        here = [values[tick] for values in felt] or NOWHERE
        outputs = names.of(step(tick, here[0], here[1], [values[tick] for values in used]))
        if tick in held:
            outputs |= command
        command = {name: outputs[name] for name in names.held}
        for name, value in outputs.items():
            match = matches.setdefault(name, Match())
            if name in columns:
                match.take(columns["t"][tick], value, columns[name][tick])
    return {f"{MASTER}/{name}": match for name, match in matches.items()}


def hold(step: MasterStep, tick: int, resumed: int | None) -> None:
    """Hold the building from a tick on, and resume it at the tick at which the test was resumed."""
    if step.time is None:
        raise InputError(
            "The recording has a hold, which its plan does not allow: nothing limits the speed of a target."
        )
    step.hold(tick)
    if resumed is not None:
        step.time.resume(resumed)


class ComputedSignals:
    """The master's computed signals by the names of its topic; those in `held` stay where a tick moves nothing."""

    def __init__(self, plan: Plan) -> None:
        from laboratories import kinds
        from loop.names import sent_names

        own, sent = kinds.own(plan), sent_names(plan)
        self._own = own.channels if own else None
        self._groups = [(group, sent[group[0][1]]) for group in slaves_alike(plan)]
        written = self._own.drives if self._own else ()
        self.held = (*written, *(name for _, names in self._groups for name in names))

    def of(self, outputs: Outputs) -> dict[str, Any]:
        """The signals of one tick; several slaves of a kind, or several storeys, give a list each."""
        found: dict[str, Any] = {"ground_acceleration": outputs.ground_acceleration}
        if self._own:
            found |= {self._own.target.name: outputs.target, self._own.command.name: outputs.command}
            found |= {self._own.effort.name: outputs.effort} if self._own.effort else {}
        for group, names in self._groups:
            rows = [commanded(outputs.sent[place], names) for place, _ in group]
            columns = rows[0] if len(rows) == 1 else map(list, zip(*rows, strict=True))
            found |= dict(zip(names, columns, strict=True))
        for name, values in outputs.of_storeys.items():
            found[name] = values[0] if len(values) == 1 else values
        return found


def commanded(sent: tuple[float, ...], names: Sequence[str]) -> tuple[float, ...]:
    """The values that a slave was sent, without the motor's force where its kind has none."""
    return sent if len(names) == len(sent) else (sent[0], *sent[2:])


def slaves_alike(plan: Plan) -> list[list[tuple[int, str]]]:
    """The slaves of each kind that share fields of the master's topic: place among all slaves, and role."""
    from common.signals import alike
    from laboratories.kinds import kind_of

    groups = alike({role: kind_of(plan, role).channels for role in plan.roles})
    return [[(plan.roles.index(role), role) for role in roles] for roles in groups.values()]


def forces_used(plan: Plan, columns: dict[str, Any]) -> list[Any]:
    """The force of each slave that the master used, tick by tick, in the plan's order of the slaves."""
    from laboratories.kinds import kind_of

    found: dict[int, Any] = {}
    for group in slaves_alike(plan):
        values = columns[kind_of(plan, group[0][1]).channels.used]
        several = [values] if len(group) == 1 else list(zip(*values, strict=True))
        found |= {place: one for (place, _), one in zip(group, several, strict=False)}
    return [found.get(place, ()) for place in range(len(plan.roles))]


def held_ticks(recording: Run, commands: Sequence[float]) -> set[int]:
    """Ticks in which the master moved nothing, because it was late or had stopped, and sent no slave anything.

    A test without slaves records no latency; there these are the ticks that repeat the command to the master's own rig.
    """
    if not recording.roles:
        return {tick for tick in range(1, len(commands)) if commands[tick] == commands[tick - 1]}
    topic = latency_topic(recording.roles[0])
    latency = recording.columns.get(topic, {})
    if not {"seq", "command_sent_ns"} <= latency.keys():
        return set()
    return {
        int(seq) for seq, sent in zip(latency["seq"], latency["command_sent_ns"], strict=True) if sent == 0
    }


def ground_of(recording: Run) -> Any:
    """The ground motion that the recording carries."""
    import numpy as np

    from common.recording.run import GROUND

    if GROUND not in recording.attachments:
        raise InputError(f"{recording.path} cannot be replayed: it carries no ground motion.")
    return np.frombuffer(recording.attachments[GROUND], dtype="<f8").reshape(2, -1).copy()


def replay_slaves(recording: Run, plan: Plan, tell: Tell = untold) -> dict[str, Match]:
    """The commands as each slave used them, its compensator's output, and the feedbacks as the master used them."""
    from laboratories.kinds import kind_of

    matches: dict[str, Match] = {}
    for role in recording.roles:
        if recording.has(role):
            tell(f"the {title(role)}'s ticks", 0, 0)
            used, suffix = kind_of(plan, role).channels.used, role.removeprefix(SLAVE)
            for name, match in replay_exchange(recording, plan, role).items():
                matches[f"{MASTER}/{name}{suffix}" if name == used else f"{role}/{name}"] = match
    return matches


def replay_exchange(whole: Run, plan: Plan, role: str) -> dict[str, Match]:
    """Both directions of the exchange with one slave, and the command of its transfer system."""
    from laboratories.kinds import kind_of
    from loop.names import sent_names

    recording, channels = whole.of(role), kind_of(plan, role).channels
    slave = {name: values.tolist() for name, values in recording.columns[SLAVE].items()}
    master = {name: values.tolist() for name, values in recording.columns[MASTER].items()}
    sent = {seq: place for place, seq in enumerate(master["seq"])}
    read = {seq: place for place, seq in enumerate(slave.get("seq", []))}
    pairs = list(zip(sent_names(plan)[role], channels.sent, strict=True))
    force, used = channels.force, channels.used
    matches = {name: Match() for name in (*channels.sent, channels.command.name, used)}
    ramp = whole.ramps.get(role, {}).get("seq", ())
    replay_command(plan, role, slave, matches[channels.command.name], set(map(int, ramp)))
    for place, (t, seq) in enumerate(zip(slave.get("t", []), slave.get("command_seq", []), strict=False)):
        if (source := sent.get(seq)) is not None:
            for there, here in pairs:
                if there in master and here in slave:
                    matches[here].take(t, master[there][source], slave[here][place])
    for place, (t, seq) in enumerate(zip(master["t"], master.get(channels.used_seq, []), strict=False)):
        if (source := read.get(seq)) is not None and force in slave:
            matches[used].take(t, slave[force][source], master[used][place])
    return matches


def replay_command(plan: Plan, role: str, slave: dict[str, Any], match: Match, ramped: set[int]) -> None:
    """The slave's compensator, from the first tick to the first that is missing, without ticks `ramped` to rest."""
    from common.protocol.messages import Command
    from laboratories.kinds import kind_of
    from slave.step import SlaveStep

    kind = kind_of(plan, role)
    channels, step = kind.channels, SlaveStep(plan.of(role), kind)
    needed = "t", "seq", channels.target.name, *channels.rates, *channels.names, channels.command.name
    if not slave.keys() >= set(needed):
        return
    for place, (t, seq) in enumerate(zip(slave["t"], slave["seq"], strict=True)):
        if seq != place:
            break
        target, *rates = (slave[name][place] for name in (channels.target.name, *channels.rates))
        # The force of the motor, 0.0 here, does not enter the compensator.
        command = Command(0, seq, 0, 0, -1, target, 0.0, *rates)
        computed = step(command, tuple(slave[name][place] for name in channels.names))
        if seq not in ramped:
            match.take(t, computed, slave[channels.command.name][place])


def show(matches: dict[str, Match], same: bool) -> None:
    """The result as text."""
    from report.text.terminal import table

    rows = [["signal", "ticks", "differing", "first at", "largest"]]
    compared = {name: match for name, match in matches.items() if match.compared}
    for name, match in compared.items():
        first = "" if match.first is None else f"{match.first:.3f} s"
        rows.append(
            [name, str(match.compared), str(match.differing), first, f"{match.largest:.3g}" if first else ""]
        )
    table(rows)
    if absent := [name for name in matches if name not in compared]:
        sys.stdout.write(f"not recorded, and not compared: {', '.join(absent)}\n")
    sys.stdout.write("matches to the last bit\n" if same else "does not match\n")
