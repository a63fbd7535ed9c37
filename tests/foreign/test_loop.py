"""The loop with a building that another program computes, compared with the loop with the master's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InterlockError, PlanError
from common.lab.laboratory import Laboratory
from common.plan.plan import Plan, ideal
from common.plan.read import parse
from common.reality.reality import as_planned, from_reality
from common.recording.reader import read
from common.recording.run import Run
from loop import foreign, substructure
from loop.nominal import partition
from master.assembly import warm_up_served
from master.client.pace import AsFastAsItGoes, Pace
from master.foreign import ForeignBuilding
from simulation import virtual
from tests.foreign.storeys import DAMPING, MASS, STIFFNESS, Storeys

TEXT = f"""
[test]
name = "foreign"
duration = 3.0
[structure]
mass = {list(MASS)}
stiffness = [25e6, 20e6]
damping = {list(DAMPING)}
[column]
storey = PLACE
[damper]
floor = 2
"""
BELOW = TEXT.replace("PLACE", "1")
UPSTAIRS = TEXT.replace("PLACE", "2").replace("[25e6, 20e6]", f"[18.75e6, {80e6 / 3!r}]")
FOREIGN = BELOW.replace("mass =", 'model = "opensees:nowhere.py"\nmass =')


def played(plan: Plan, path: Path, model: Storeys | None = None, pace: Pace | None = None) -> Run:
    building = None
    if model is not None:
        rows = substructure.ground_rows(plan, substructure.motion(plan))
        warm_up_served(as_planned(plan))
        building = ForeignBuilding(plan, model, rows, pace or AsFastAsItGoes(1.0, str, "building"))
    assert virtual.run(virtual.assemble(plan, as_planned(plan), path, building=building), str) is None
    return read(path)


def model_of(plan: Plan, late: tuple[int, ...] = ()) -> Storeys:
    return Storeys(substructure.ground_rows(plan, substructure.motion(plan))[0], plan.test.interval, late)


@pytest.mark.parametrize("text", [BELOW, UPSTAIRS], ids=["below", "upstairs"])
def test_the_loop_with_another_program_equals_the_loop_with_the_masters_own_building(
    text: str, tmp_path: Path
) -> None:
    """With ideal transfer systems; of others the rates of the target are differences of it, and nearly the same."""
    plan = ideal(parse(text, tmp_path))
    assert partition.storey_stiffnesses(plan).tolist() == pytest.approx(STIFFNESS)
    own = played(plan, tmp_path / "own.mcap").columns
    found = played(plan, tmp_path / "found.mcap", model_of(plan)).columns
    for name in ("displacement", "velocity", "acceleration", "absolute_acceleration", "ground_acceleration"):
        near(found["master"][name], own["master"][name])
    for name in ("column_target", "column_force", "damper_force_used", "table_target", "damper_command"):
        near(found["master"][name], own["master"][name])
    drift = np.diff(found["master"]["velocity"], axis=1, prepend=0.0)
    near(found["master"]["numerical_force"], own["master"]["numerical_force"] + DAMPING * drift)


def near(found: Any, expected: Any) -> None:
    assert found.shape == expected.shape
    assert np.max(np.abs(found - expected)) <= 1e-9 * np.max(np.abs(expected))


class Ticking(Pace):
    """As in real time a tick ends whether the program has answered or not."""

    settles = True
    eager = 0

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """Nothing is left once it is asked."""
        return lambda: 0.0

    def fair(self, lab: Laboratory, tick: int, since_ns: int) -> bool:
        """Every tick gives the program its time."""
        return True

    def over(self) -> None:
        """The watchdog counts."""


def test_a_late_step_holds_all_commands_and_pauses_the_buildings_time(tmp_path: Path) -> None:
    plan = parse(BELOW, tmp_path)
    late = (300, 301, 700)
    run = played(plan, tmp_path / "late.mcap", model_of(plan, late), Ticking())
    of, whole = run.columns["master"], played(plan, tmp_path / "own.mcap", model_of(plan)).columns["master"]
    kept = [tick for tick in range(plan.ticks) if tick not in (300, 302, 702)]
    assert np.array_equal(of["ground_acceleration"][kept], whole["ground_acceleration"][: len(kept)])
    for tick in (300, 302, 702):
        for name in ("displacement", "actuator_command", "table_target"):
            assert np.array_equal(of[name][tick], of[name][tick - 1])
    (event,) = [one for one in run.events if one["code"] == "building"]
    assert event["values"]["late"] == 3.0
    assert event["values"]["steps"] == plan.ticks - 3


def test_a_building_program_that_falls_silent_brings_the_laboratories_to_rest(tmp_path: Path) -> None:
    plan = parse(BELOW + "[safety]\nhold_after = 3\nramp_after = 5\n", tmp_path)
    model = model_of(plan, (200,) * 50)
    rows = substructure.ground_rows(plan, substructure.motion(plan))
    building = ForeignBuilding(plan, model, rows, Ticking())
    path = tmp_path / "silent.mcap"
    error = virtual.run(virtual.assemble(plan, as_planned(plan), path, building=building), str)
    assert error is not None
    assert error.exit_code == 4
    assert "building" in str(error)
    run = read(path)
    assert run.ramps["master"]["mode"][-1] == "safe"
    assert len(run.columns["master"]["seq"]) == 205


class Silent(Storeys):
    """A program that never answers."""

    def motion(self, seconds: float) -> None:
        """None, however long it is waited for."""


def test_a_building_program_that_never_answers_ends_a_test_in_virtual_time(tmp_path: Path) -> None:
    plan = parse(BELOW, tmp_path)
    rows = substructure.ground_rows(plan, substructure.motion(plan))
    model = Silent(rows[0], plan.test.interval)
    building = ForeignBuilding(plan, model, rows, AsFastAsItGoes(0.02, str, "building"))
    path = tmp_path / "silent.mcap"
    error = virtual.run(virtual.assemble(plan, as_planned(plan), path, building=building), str)
    assert "No displacement has come from the building for 0.02 s." in str(error)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            ("opensees:nowhere.py", "opensess:nowhere.py"),
            "must be one of plan, client, opensees:FILE.py, FILE.fmu",
        ),
        (("stiffness", "#"), "names the model 'opensees:nowhere.py' without stiffness"),
        (("[column]", "[structure.experimental]\nstiffness = 6e6\n[column]"), "structure.experimental"),
        (('model = "opensees:nowhere.py"', "options = { a = 1 }"), "options in .structure. are for a model"),
    ],
)
def test_a_plan_that_does_not_fit_its_model_is_refused(change: tuple[str, str], says: str) -> None:
    with pytest.raises(PlanError, match=says):
        parse(FOREIGN.replace(*change), Path())


def test_a_plan_without_a_model_keeps_its_digest_and_one_with_a_model_is_written_and_read() -> None:
    assert {"model", "options", "intervals"}.isdisjoint(Plan().tables()["structure"])
    plan = parse(FOREIGN.replace("mass =", "options = { bars = 3 }\nmass ="), Path())
    again = parse(plan.toml(), Path())
    assert again.structure == plan.structure
    assert again.structure.options == {"bars": 3}
    assert again.digest() == plan.digest() != parse(FOREIGN, Path()).digest()


def test_a_reality_may_change_only_the_options_of_a_building_model() -> None:
    plan = parse(FOREIGN, Path())
    truth = from_reality({"structure": {"options": {"bars": 2}}}, plan, Path())
    assert truth.plan.structure.options == {"bars": 2}
    with pytest.raises(PlanError, match="stiffness in .structure. says nothing of 'opensees:nowhere.py'"):
        from_reality({"structure": {"stiffness": [1e6, 1e6]}}, plan, Path())


@pytest.mark.parametrize("verb", ["simulate", "check", "run"])
def test_a_command_that_cannot_compute_the_building_is_refused_with_the_reason(
    verb: str, tmp_path: Path, call: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "plan.toml").write_text(FOREIGN)
    more = ["--virtual", "-o", tmp_path / "a.mcap"] if verb == "run" else []
    assert call(verb, tmp_path / "plan.toml", *more) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    says = "computes the plan's building" if verb == "simulate" else "There is no file"
    assert says in said
    assert said.endswith(".")


def test_the_step_times_of_a_model_are_judged_in_real_time_only() -> None:
    plan = parse(FOREIGN, Path())  # 2 ms, of which a tick waits 75 %
    ranked = [1e-3] * 98 + [1.4e-3, 9e-3]
    good = foreign.judged(plan, "frame.py", ranked, paced=True)
    assert good.risk is None
    assert good.text == (
        "A step of the building 'frame.py' takes 1.00 ms, 99% of 100 at most 1.40 ms: it holds intervals from 1.9 ms on"
    )
    held = foreign.judged(plan, "frame.py", [1e-3] * 95 + [9e-3] * 5, paced=True)
    assert held.risk is None  # of emulated laboratories
    assert held.text.endswith(
        "from 12.0 ms on; the emulated laboratories hold over the steps that come later"
    )
    real = parse(FOREIGN + '[master.rig]\naddress = "udp/127.0.0.1:9107"\n', Path())
    assert foreign.judged(real, "frame.py", [1e-3] * 95 + [9e-3] * 5, paced=True).risk is not None
    slow = foreign.judged(plan, "frame.py", [2.0 * one for one in ranked], paced=True)
    assert slow.risk is not None
    assert slow.risk.name == "building"
    assert "raise interval in [test] to 3.8 ms" in slow.risk.sentence
    assert foreign.judged(plan, "frame.py", [1.0], paced=False).risk is None


def test_a_building_program_that_ends_is_an_interlock(tmp_path: Path) -> None:
    plan = parse(BELOW, tmp_path)
    model = model_of(plan)

    advance, steps = model.advance, iter(range(100))

    def torn(forces: Sequence[float]) -> None:
        if next(steps, None) is None:
            raise InterlockError("The building 'storeys' has ended: it is torn.")
        advance(forces)

    model.advance = torn  # type: ignore[method-assign]
    rows = substructure.ground_rows(plan, substructure.motion(plan))
    building = ForeignBuilding(plan, model, rows, AsFastAsItGoes(1.0, str, "building"))
    path = tmp_path / "torn.mcap"
    error = virtual.run(virtual.assemble(plan, as_planned(plan), path, building=building), str)
    assert str(error) == "The building 'storeys' has ended: it is torn."
    run = read(path)
    assert run.ramps["master"]["mode"][-1] == "safe"
    assert next(one["code"] for one in run.events if one["level"] == "error") == "building"
