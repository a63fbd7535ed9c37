"""`rths replay`: the computed signals of a recording computed again from its measurements."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.roles import MASTER, SLAVE, latency_topic, title
from common.signals import SENT
from common.terminal import cli
from common.terminal.printable import shown
from common.terminal.telling import Tell, untold
from report.text.progress import Progress

if TYPE_CHECKING:
    from common.recording.reader import Run
    from master.step import Outputs

HELD = ("actuator_command", *SENT)


@dataclass
class Match:
    """How well one signal was met: ticks compared, and where it differs first."""

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
    cli.json_argument(parser, "write the result as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Replay; 1 where a computed signal differs from the recorded one."""
    with Progress("replaying") as progress:
        from common.recording.reader import read

        recording = read(args.file)
        matches = {**replay_master(recording, progress.tell), **replay_slave(recording, progress.tell)}
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


def replay_master(recording: Run, tell: Tell = untold) -> dict[str, Match]:
    """The building, the compensator and the damper's control again, from the first tick to the first hole."""
    from master.step import MasterStep
    from report.facts.laboratories import plan_of

    plan = plan_of(recording)
    if plan is None or not recording.has(MASTER):
        raise InputError(f"{recording.path} holds no plan and master's signals to replay.")
    columns = {name: values.tolist() for name, values in recording.columns["master"].items()}
    step = MasterStep(plan, ground_of(recording))
    held = held_ticks(recording)
    matches: dict[str, Match] = {}
    command = dict.fromkeys(HELD, 0.0)
    for tick, seq in enumerate(columns["seq"]):
        if seq != tick:
            break
        tell("the master's ticks", tick, len(columns["seq"]))
        outputs = named(
            step(
                tick,
                columns["column_displacement"][tick],
                columns["column_force"][tick],
                per_slave(columns["damper_force_used"][tick]),
            )
        )
        if tick in held:
            outputs |= command
        command = {name: outputs[name] for name in HELD}
        for name, value in outputs.items():
            matches.setdefault(name, Match()).take(columns["t"][tick], value, columns[name][tick])
    return {f"master/{name}": match for name, match in matches.items()}


def named(outputs: Outputs) -> dict[str, Any]:
    """What the master computed, by the signals of its topic."""
    sent = outputs.sent[0] if len(outputs.sent) == 1 else map(list, zip(*outputs.sent, strict=True))
    storeys = outputs.of_storeys
    return {
        "ground_acceleration": outputs.ground_acceleration,
        "column_target": outputs.target,
        "actuator_command": outputs.command,
        **dict(zip(SENT, sent, strict=True)),
        **{name: values[0] if len(values) == 1 else values for name, values in storeys.items()},
    }


def per_slave(values: float | list[float]) -> list[float]:
    """What the master's topic has as one value where there is one slave, and as a list of several."""
    return values if isinstance(values, list) else [values]


def held_ticks(recording: Run) -> set[int]:
    """Ticks in which the master moved nothing, because it came too late or stopped; then no slave was sent anything."""
    topic = latency_topic(recording.roles[0]) if recording.roles else ""
    if not recording.has(topic):
        return set()
    latency = recording.columns[topic]
    return {
        int(seq) for seq, sent in zip(latency["seq"], latency["command_sent_ns"], strict=True) if sent == 0
    }


def ground_of(recording: Run) -> Any:
    """The ground motion that the recording carries."""
    import numpy as np

    from common.recording.reader import GROUND

    if GROUND not in recording.attachments:
        raise InputError(f"{recording.path} carries no ground motion: it cannot be replayed.")
    return np.frombuffer(recording.attachments[GROUND], dtype="<f8").reshape(2, -1).copy()


def replay_slave(recording: Run, tell: Tell = untold) -> dict[str, Match]:
    """What each slave did with the commands it had, and the master with the feedbacks it had."""
    matches: dict[str, Match] = {}
    for role in recording.roles:
        if recording.has(role):
            tell(f"what the {title(role)} did", 0, 0)
            suffix = role.removeprefix(SLAVE)
            for name, match in replay_exchange(recording, role).items():
                place = f"{MASTER}/{name}{suffix}" if name == "damper_force_used" else f"{role}/{name}"
                matches[place] = match
    return matches


def replay_exchange(whole: Run, role: str) -> dict[str, Match]:
    """Both directions of the exchange with one slave, and its table's command."""
    recording = whole.of(role)
    slave = {name: values.tolist() for name, values in recording.columns["slave"].items()}
    master = {name: values.tolist() for name, values in recording.columns["master"].items()}
    sent = {seq: place for place, seq in enumerate(master["seq"])}
    read = {seq: place for place, seq in enumerate(slave["seq"])}
    matches = {name: Match() for name in (*SENT, "table_command", "damper_force_used")}
    ramp = whole.ramps.get(role, {}).get("seq", ())
    replay_table(recording, slave, matches["table_command"], set(map(int, ramp)))
    for place, t in enumerate(slave["t"]):
        if (source := sent.get(slave["command_seq"][place])) is not None:
            for name in SENT:
                matches[name].take(t, master[name][source], slave[name][place])
    for place, t in enumerate(master["t"]):
        if (source := read.get(master["damper_force_seq"][place])) is not None:
            matches["damper_force_used"].take(
                t, slave["damper_force"][source], master["damper_force_used"][place]
            )
    return matches


def replay_table(recording: Run, slave: dict[str, Any], match: Match, ramped: set[int]) -> None:
    """The table's compensator again, from the first tick to the first hole; not where it was `ramped` to rest."""
    from common.protocol.messages import Command
    from common.rig import TableMeasurement
    from laboratories.table.kind import TABLE
    from report.facts.laboratories import plan_of
    from slave.step import SlaveStep

    plan = plan_of(recording)
    if plan is None:
        return
    step = SlaveStep(plan, TABLE)
    for place, (t, seq) in enumerate(zip(slave["t"], slave["seq"], strict=True)):
        if seq != place:
            break
        command = Command(0, seq, 0, 0, -1, *(slave[name][place] for name in SENT))
        measured = TableMeasurement(*(slave[name][place] for name in TableMeasurement._fields))
        computed = step(command, measured)
        if seq not in ramped:
            match.take(t, computed, slave["table_command"][place])


def show(matches: dict[str, Match], same: bool) -> None:
    """The result as text."""
    from report.text.terminal import table

    rows = [["signal", "ticks", "differing", "first at", "largest"]]
    for name, match in matches.items():
        first = "" if match.first is None else f"{match.first:.3f} s"
        rows.append(
            [name, str(match.compared), str(match.differing), first, f"{match.largest:.3g}" if first else ""]
        )
    table(rows)
    sys.stdout.write("matches to the last bit\n" if same else "does not match\n")
