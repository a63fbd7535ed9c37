"""Readings beside commands that came through the logger too, as analogue outputs of a controller do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from common.recording.imported import NOTHING_STATED, ImportedChannel


def beside_commands(
    readings: Sequence[ImportedChannel], commands: Sequence[ImportedChannel], held: float
) -> tuple[ImportedChannel, ...]:
    """What readings passed that the commands of their laboratory did not.

    A filter of both is as none: a machine makes of a filtered command what the filter makes of its reading. One of the
    command alone makes readings early. `held` (s) is by how much an output that holds its value is later than the
    command that it stands for, which a filter or mean turns into a delay. Commands that passed different filters leave
    the readings as they are.
    """
    chains = {one.chain for one in commands}
    if len(chains) != 1 or chains == {NOTHING_STATED.chain}:
        return tuple(readings)
    (command,) = chains
    return tuple(beside(one, command, held if command.blunt else 0.0) for one in readings)


def beside(reading: ImportedChannel, command: ImportedChannel, held: float) -> ImportedChannel:
    """What a reading passed beside a command."""
    own, its = (replace(one.chain, delay=0.0) for one in (reading, command))
    if own == its:
        plain = replace(reading, filter=None, average=0.0, means=1, smooth=False, high_pass=0.0)
        return replace(plain, delay=reading.delay - command.delay - held)
    return replace(reading, delay=reading.delay - command.late - held)
