"""What looks like loud noise of readings, and is a machine's motion or what an effect does from tick to tick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import examine
from diagnosis.findings import where
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.noise import sensor_noise
from tests.diagnosis.cases import Cases, lab_a, lab_b, moved_by, white

STEP = 4e-5  # m, of the converter that gives a table its command
RESTLESS = 3e-5  # m, by which an actuator's command changes from tick to tick


def on_part(found: Diagnosis, name: str) -> PartVerdict:
    """The verdict on one part."""
    return next(item for item in found.verdicts if item.search.data.part.name == name)


@pytest.mark.slow
def test_noise_that_shakes_a_whole_table_is_none_of_its_accelerometer(cases: Cases) -> None:
    whole = cases.record()
    part = lab_b(whole)
    command = part.inputs[next(iter(part.inputs))]
    shaken = moved_by(whole, STEP * np.round(command / STEP) - command)
    change = shaken.signals["table_acceleration"] - whole.signals["table_acceleration"]
    felt = whole.signals["table_acceleration"] + np.std(change) * white(47, whole.ticks)
    motion, noise = (
        examine(shaken),
        examine(replace(whole, signals=whole.signals | {"table_acceleration": felt})),
    )
    verdict = on_part(motion, part.name)
    assert (verdict.outcome, motion.readings) == ("unknown", [])
    assert where.culprits(verdict.search.chosen)[0] == "table"
    assert [item.effect for item in noise.readings] == ["sensor.table_acceleration.noise"]


@pytest.mark.long
def test_an_inertia_that_a_restless_command_hides_in_noise_is_found(cases: Cases) -> None:
    whole = cases.record(scale=0.02, duration=4.0)
    part = lab_a(whole)
    (command,) = part.inputs
    restless = part.inputs[command] + RESTLESS * white(53, whole.ticks)
    system = residuals.prepare(part, whole).system
    heavy = whole.catalogue["column.inertia"].apply(system, mass=1000.0)
    moved = part.replaced(inputs=part.inputs | {command: restless}).predict(heavy) - part.predict(system)
    felt = {name: whole.signals[name] + x for name, x in zip(part.signals, moved.T, strict=True)}
    found = examine(replace(whole, signals=whole.signals | felt | {command: restless}))
    verdict = on_part(found, part.name)
    assert (verdict.outcome, found.readings) == ("explained", [])
    assert verdict.search.chosen.values["column.inertia"]["mass"] == pytest.approx(1000.0, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize(
    ("times", "alone"), [((15.0, 1.2), True), ((15.0, 14.0), False), ((15.0,), True), ((5.0, 0.2), False)]
)
def test_noise_stands_out_where_no_other_reading_has_any_like_it(
    cases: Cases, monkeypatch: pytest.MonkeyPatch, times: tuple[float, ...], alone: bool
) -> None:
    whole = cases.record()
    bare = fitting.at(data := residuals.prepare(lab_a(whole), whole), {}, np.zeros(len(data.part.nuisances)))
    monkeypatch.setattr(sensor_noise, "loudest", lambda _: np.array(times))
    assert settling.stands_out(bare) is alone
