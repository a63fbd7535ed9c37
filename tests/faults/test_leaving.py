"""A slave whose ramp to rest lasts longer than the master's: the master, who routes, stays, and no row is lost."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from common.recording.reader import read
from common.roles import MASTER, RECORDER, SLAVE
from common.safety.modes import Mode
from tests.faults.simulated import LOST, Scene
from validation.faults.rigs import Probe, Wrong

AT = 250  # the tick of a trip
DURATION = 0.6  # s
SLOW = 40_000_000  # ns of a read(), in which twenty intervals pass
STEP = 10_000_000  # ns between two looks at whether the master is still there


def slow(probe: Probe, *modes: Mode) -> None:
    """Makes the rig's read() slow in some modes, in all where none is named."""
    read = probe.read

    def slowly() -> Iterable[float]:
        assert probe.loop is not None
        if not modes or probe.loop.lab.safety.mode in modes:
            probe.process.spend(SLOW)
        return read()

    probe.read = slowly  # type: ignore[method-assign]


def own_slow_rig(scene: Scene) -> None:
    scene.at(AT, slow, scene.simulation.probes[SLAVE])


def trip_of_the_master(scene: Scene) -> None:
    slow(scene.simulation.probes[SLAVE], Mode.RAMPING)
    scene.at(AT, scene.simulation.probes[MASTER].set_wrong, "it", Wrong("beyond", 1, 1e9))


def silence_of_the_slave(scene: Scene) -> None:
    slow(scene.simulation.probes[SLAVE], Mode.RAMPING)
    scene.at(AT, scene.simulation.world.processes[SLAVE].stall, 900_000_000)


def end_of_the_test(scene: Scene) -> None:
    slow(scene.simulation.probes[SLAVE], Mode.RAMPING)


def routed(scene: Scene) -> None:
    """Once the master has ended, nothing passes between the slave and the recorder."""
    world, wire = scene.simulation.world, scene.simulation.wire
    if not world.processes[MASTER].ended:
        world.at(world.time + STEP, routed, scene)
        return
    for direction in wire.between(SLAVE, RECORDER) + wire.between(RECORDER, SLAVE):
        direction.lay("gone", LOST)


def ramp(probe: Probe) -> tuple[list[int], list[float]]:
    """The times (ns) and the displacements (m) of a rig's commands during its ramp to rest."""
    log = probe.log
    steps = [place for place, mode in enumerate(log.modes) if mode is Mode.RAMPING]
    return [log.times[place] for place in steps], [log.commands[place][0] for place in steps]


@pytest.mark.parametrize("befall", [own_slow_rig, trip_of_the_master, silence_of_the_slave, end_of_the_test])
def test_no_recorded_row_is_lost_of_a_slave_that_comes_to_rest_long_after_the_master(
    tmp_path: Path, befall: Callable[[Scene], None]
) -> None:
    scene = Scene(tmp_path, DURATION)
    routed(scene)
    befall(scene)
    simulation = scene.simulation
    simulation.run()
    run = read(scene.path)
    ways = {role: ramp(probe) for role, probe in simulation.probes.items()}
    lasted = {role: times[-1] - times[0] for role, (times, _) in ways.items()}
    assert lasted[SLAVE] > 10 * lasted[MASTER]
    assert simulation.recorder is not None
    assert simulation.recorder.error is None
    assert [one["text"] for one in run.events if one["code"] == "rows_lost"] == []
    assert np.array_equal(run.ramps[SLAVE]["table_command"], ways[SLAVE][1])
