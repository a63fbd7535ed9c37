"""The tests of a sweep follow their plans, keep the order of the file, and do not depend on the workers."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from common.errors import InputError
from common.plan import read as plans
from common.reality import reality as realities
from loop import substructure
from loop.closed_loop import simulate
from loop.nominal import limited
from loop.of_reality import really
from loop.signals import by_role
from models.ground_motion.motions import FOLDER
from simulation.sweep import definition, luggage, measures, play, rows, table
from simulation.workers.parts import Way
from tests.helpers import ROOT

SWEEP = """
seed = 3
draws = 2
noise = true
[[motion]]
record = "records/own.AT2"
scales = [0.1, 0.2]
[[motion]]
[parameters]
"test.duration" = [0.4]
"control.amd" = [true, false]
[drawn]
structure.damping = { dispersion = 0.3 }
[intensity]
period = 0.5
[[compensator]]
[[compensator]]
name = "a weak one"
kind = "pid"
proportional = 0.5
integral = 0.0
derivative = 0.0
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "sweep.toml"
    path.write_text(SWEEP)
    (tmp_path / "records").mkdir()
    shutil.copy(FOLDER / "RSN77_SFERN_PUL164.AT2", tmp_path / "records" / "own.AT2")
    return path


def test_the_rows_of_a_sweep_equal_the_tests_of_their_plans(file: Path, tmp_path: Path) -> None:
    sweep = definition.load(file)
    made = table.table(tmp_path / "a.parquet", sweep, Way())
    assert made.num_rows == sweep.rows == 2 * 2 * 3 * 2
    for number in (0, 13, 23):
        found = {name: made.column(name)[number].as_py() for name in made.column_names}
        plan = rows.plan_of(sweep, rows.row(sweep, number))
        base = tmp_path if found["motion"] == "records/own.AT2" else sweep.plan.base
        at = plans.from_tables(plan.written(), base)
        assert found["plan"] == at.digest()
        ground = substructure.ground_rows(at, substructure.motion(at))
        rollout = simulate(at, ground, seed=at.test.seed)
        floors = rollout.master["displacement"]
        assert found["peak_drift"] == float(np.max(np.abs(floors)))
        assert found["pga"] == float(np.max(np.abs(ground[0])))
        tops = limited.magnitudes(at, by_role(at, rollout))
        assert {name: found[name] for name in tops} == {
            name: float(np.max(top)) for name, top in tops.items()
        }
        assert found["limit_share"] == max(
            found[name] / value for name, value in limited.most(at).items() if name in tops
        )
    assert made.column("compensator").to_pylist() == ["as planned"] * 12 + ["a weak one"] * 12
    assert made.column("control.amd").to_pylist() == 2 * ([True] * 6 + [False] * 6)
    assert made.column("scale").to_pylist()[:6] == [0.1, 0.1, 0.2, 0.2, 0.1, 0.1]
    dampings = made.column("structure.damping").to_pylist()
    assert len(set(dampings)) == 2
    assert dampings[:2] * 12 == dampings


@pytest.mark.parametrize("name", ["default", "single_site", "two_columns", "two_storeys"])
def test_the_peaks_of_a_sweep_are_the_largest_magnitudes(name: str) -> None:
    plan = plans.load(ROOT / "rths" / "plans" / f"{name}.toml").with_ticks(400)
    rollout = simulate(plan, substructure.ground_rows(plan, substructure.motion(plan)), seed=1)
    columns = by_role(plan, rollout)
    every = limited.magnitudes(plan, columns)
    assert limited.peaks(plan, columns) == {name: float(np.max(values)) for name, values in every.items()}


@pytest.mark.long
def test_one_worker_two_workers_and_a_resumed_sweep_give_the_same_bytes(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(play, "SIZE", 64)
    sweep = definition.load(file)
    sweep = definition.from_tables(
        {
            "draws": 70,
            "motion": [{"scales": [0.1, 0.2]}],
            "parameters": {"test.duration": [0.01]},
            "noise": True,
        },
        sweep.base,
    )
    paths = [tmp_path / f"{name}.parquet" for name in ("one", "two", "again")]
    table.table(paths[0], sweep, Way(1))
    table.table(paths[1], sweep, Way(2))
    real = play.batch

    def stopped(task: play.Task) -> object:
        if task.number == 1:
            raise KeyboardInterrupt
        return real(task)

    monkeypatch.setattr(table, "batch", stopped)
    with pytest.raises(KeyboardInterrupt):
        table.table(paths[2], sweep, Way(1))
    monkeypatch.setattr(table, "batch", real)
    table.table(paths[2], sweep, Way(1))
    assert len({path.read_bytes() for path in paths}) == 1
    assert parquet.read_table(paths[0]).column("row").to_pylist() == list(range(140))


def test_the_files_of_a_sweep_are_sent_to_the_workers(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = luggage.packed(definition.load(file))
    shutil.rmtree(tmp_path / "records")
    file.unlink()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    found = play.batch(play.Task(given, "files that travel", 0))
    assert len(found.columns["row"]) == 24
    assert found.columns["record"][0].startswith("file own.AT2, digest ")


def test_a_loop_that_diverges_exceeds_every_limit() -> None:
    plan = plans.load(ROOT / "rths" / "plans" / "default.toml")
    changed = plans.from_tables(
        plan.written()
        | {"compensator": {"kind": "pid", "proportional": 50.0, "integral": 0.0, "derivative": 0.0}},
        plan.base,
    )
    rollout = simulate(changed, substructure.ground_rows(changed, substructure.motion(changed)))
    found = measures.measured(changed, rollout)
    assert found["outcome"] == measures.DIVERGED
    assert found["peak_drift"] == found["limit_share"] == np.inf


def test_a_worker_loads_no_package_that_only_the_table_needs() -> None:
    """Each takes a tenth to half a second of processor time in every worker."""
    code = "import sys, simulation.sweep.play; print(*{'pyarrow', 'scipy.signal', 'scipy.stats'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not done.stdout.strip()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ("colour = 1\n", "Unknown entry 'colour'"),
        ('plan = "no.toml"\n', "Cannot read the plan"),
        ('reality = "no.toml"\n', "Cannot read the reality"),
        ("[parameters]\n'structure.mas' = [1.0]\n", "no key 'structure.mas': did you mean structure.mass\\?"),
        ("[parameters]\nstructure.mass = 1.0\n", "'structure.mass' in \\[parameters\\] is 1.0, but must be a list"),
        ("[parameters]\nstructure.mass = [-1.0]\n", "mass in \\[structure\\] is -1.0, but must be above 0 kg"),
        ("[drawn]\nstructure.mass = { dispersion = 0.1, distribution = 'beta' }\n", "must be one of lognormal"),
        ("[drawn]\ncolumn.mass = { dispersion = 0.1 }\n", "only a number other than 0 can be drawn about"),
        ("draws = 5\n", "draws is 5, but nothing is drawn"),
        ("[[motion]]\nrecord = 'el_centro'\n", "did you mean el_centro_1940_ns"),
        ("[[motion]]\nscales = { from = 1.0, to = 0.5, count = 3 }\n", "from must be above 0 and below to"),
        ("[[motion]]\nscales = [0.0]\n", "scales holds 0.0, but must hold numbers above 0"),
        ("[[compensator]]\nlead = 0.1\n", "kind is missing"),
        ("[[compensator]]\n[[compensator]]\n", "Two \\[\\[compensator\\]\\] are called 'as planned'"),
        ("draws = 1000000\nnoise = true\n[[motion]]\nscales = {from=0.1, to=1.0, count=99}\n", "at most 10,000,000"),
    ],
)  # fmt: skip
def test_a_wrong_sweep_is_refused_in_one_sentence(change: str, complaint: str, tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_text(change)
    with pytest.raises(InputError, match=complaint) as error:
        table.table(tmp_path / "a.parquet", definition.load(file), Way())
    assert str(error.value).count("\n") == 0
    assert list(tmp_path.iterdir()) == [file]


def test_a_reality_found_with_another_plan_is_refused_for_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "found.toml").write_text("[found]\nmodels = '0123456789abcdef'\n")
    sweep = definition.from_tables({"reality": "found.toml"}, tmp_path)
    with pytest.raises(
        InputError, match="The reality found.toml: it was found with other nominal models than this"
    ):
        table.table(tmp_path / "a.parquet", sweep, Way())


def test_a_sweep_with_a_reality_runs_in_its_laboratories(tmp_path: Path) -> None:
    text = "[[effect]]\nname = 'column.friction'\nforce = 900.0\n"
    (tmp_path / "hidden.toml").write_text(text)
    brief = {"parameters": {"test.duration": [2.0]}, "motion": [{"scales": [0.2]}]}
    plain, hidden = (
        table.table(tmp_path / f"{len(more)}.parquet", definition.from_tables(brief | more, tmp_path), Way())
        for more in ({}, {"reality": "hidden.toml"})
    )
    plan = rows.plan_of(
        definition.from_tables(brief, tmp_path), rows.row(definition.from_tables(brief, tmp_path), 0)
    )
    rollout = really(realities.load(tmp_path / "hidden.toml", plan), noise=False)
    drift = float(np.max(np.abs(rollout.master["displacement"])))
    assert hidden.column("peak_drift")[0].as_py() == drift != plain.column("peak_drift")[0].as_py()
