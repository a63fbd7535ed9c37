"""Predictions: draws follow the spread, bands cover as often as stated, bad files are refused in one sentence."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from common.errors import InputError, PlanError
from common.plan import read as plans
from common.plan.plan import Plan
from common.reality.found import building_of, models_of
from common.reality.reality import from_reality
from common.reality.spread import SeenRange, Spread, UncertainParameter
from common.recording.reader import read
from common.roles import MASTER
from common.terminal import cli
from loop import substructure
from loop.of_reality import really, rolled_out
from report.prediction import overlay, sentences
from rths.__main__ import main
from rths.prepare.simulate import write as record
from simulation.prediction import bands, draws, file, held, rest, shape
from simulation.prediction.bands import Prediction

FRICTION = UncertainParameter("slave", "force", "damper.friction", least=0.0, most=100.0)
STIFFNESS = UncertainParameter(MASTER, "column.stiffness")
SPREAD = Spread(
    (STIFFNESS, FRICTION),
    np.diag([0.01**2, 0.3**2]),
    noise={MASTER: {"column_force": 100.0}, "slave": {"damper_force": 0.2}},
    rest={MASTER: {"column_force": 0.01}, "slave": {"damper_force": 0.02}},
    seen={
        MASTER: SeenRange({"column_displacement": 2e-3}, (0.5, 8.0)),
        "slave": SeenRange({"damper_stroke": 1.0}, (0.5, 8.0)),
    },
)


def short(duration: float = 3.0, **test: Any) -> Plan:
    """The default plan, shorter."""
    return plans.with_test(plans.load(cli.plan_path(None)), duration=duration, **test)


def tables(plan: Plan, **more: Any) -> dict[str, Any]:
    """The laboratories that a diagnosis found, as the tables of a reality."""
    origin = {"models": models_of(plan), "building": building_of(plan), "rest": "found.npz"}
    friction = {"name": "damper.friction", "laboratory": "slave", "force": 3.0}
    return {"found": origin, "effect": [friction]} | more


def written(folder: Path, plan: Plan, spread: Spread = SPREAD, **more: Any) -> Path:
    """The path of a reality that a diagnosis found, with the file of its uncertainty beside it."""
    with (folder / "found.npz").open("wb") as stream:
        np.savez(stream, **spread.arrays())  # type: ignore[arg-type]
    path = folder / "found.toml"
    path.write_text(tomli_w.dumps(tables(plan, **more)), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the laboratories that were found."""
    result = tmp_path_factory.mktemp("predicted")
    written(result, short())
    return result


@pytest.fixture(scope="module")
def found(folder: Path) -> Prediction:
    """A prediction of a stronger test."""
    plan = short(scale=0.2)
    return bands.predict(draws.load(folder / "found.toml", plan), plan, 40)


def test_drawn_laboratories_follow_the_spread(folder: Path) -> None:
    laboratories = draws.load(folder / "found.toml", short())
    systems = draws.drawn(laboratories, np.array([0.02, -10.0]), 1)
    assert systems[MASTER].plan.column.stiffness == pytest.approx(1.02 * short().column.stiffness)
    assert systems["slave"].effects.damper.friction == 0.0  # never below what is possible
    assert systems["slave"].plan.sensors.damper_force == 0.2


def test_a_covariance_with_dependent_parameters_has_a_root() -> None:
    covariance = np.array([[1.0, 1.0], [1.0, 1.0]])
    root = draws.square_root(covariance)
    np.testing.assert_allclose(root @ root.T, covariance, atol=1e-12)


def test_a_prediction_is_the_same_every_time(folder: Path, found: Prediction) -> None:
    plan = short(scale=0.2)
    again = bands.predict(draws.load(folder / "found.toml", plan), plan, 40)
    np.testing.assert_array_equal(again.low.master["column_force"], found.low.master["column_force"])
    assert bands.plain(again) == bands.plain(found)


def test_the_band_of_drawn_laboratories_covers_others_of_the_same_distribution(
    folder: Path, found: Prediction
) -> None:
    plan = short(scale=0.2)
    laboratories = draws.load(folder / "found.toml", plan)
    random = np.random.default_rng(3)
    shares = []
    for seed in range(6):
        place = np.sqrt(np.diag(SPREAD.covariance)) * random.standard_normal(2)
        one = rolled_out(laboratories.truth, draws.drawn(laboratories, place, seed), found.motion, noise=True)
        force = one.master["column_force"]
        inside = (found.low.master["column_force"] <= force) & (force <= found.high.master["column_force"])
        shares.append(np.mean(inside))
    assert 0.85 < np.mean(shares) <= 1.0  # with the share that is left the band is wider than that of these


def test_a_test_beyond_the_diagnosed_range_is_reported(found: Prediction) -> None:
    assert any("column_displacement reaches" in sentence for sentence in found.sentences)
    assert found.reaches[MASTER].ratio > 1.1 > found.reaches["slave"].ratio


def test_the_model_error_grows_with_the_amplitude_beyond_the_diagnosed_range() -> None:
    reach = rest.RangeSeen(MASTER, "x", np.array([0.5, 1.0, 2.0]), (0.0, 9.0), 0.0)
    far, more = rest.growth({MASTER: reach}, MASTER, 0.02)
    np.testing.assert_allclose(far, [1.0, 1.0, 2.0])
    np.testing.assert_allclose(more, [0.0, 0.0, 0.02 * rest.NEW])


def test_the_rms_of_a_drawn_error_is_its_share_of_the_envelope() -> None:
    wave = np.sin(np.linspace(0.0, 40.0, 2000))
    drawn = rest.errors(np.tile(wave, (600, 1)), 0.1, np.random.default_rng(1))
    assert np.std(drawn, axis=0)[500:1500] == pytest.approx(np.full(1000, 0.1), rel=0.15)


def measured(path: Path, found: Prediction, **more: Any) -> Path:
    """A test of the laboratories as found, or with other tables of their reality, as a recording at `path`."""
    plan = short(scale=0.2)
    truth = from_reality(tables(plan, seed=5, **more), plan, path.parent)
    ground = substructure.ground_rows(plan, found.motion)
    record(path, plan, really(truth, noise=True), found.motion, ground)
    return path


def test_a_test_can_be_compared_with_a_predictions_recording(
    folder: Path, found: Prediction, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "next.mcap"
    file.write(path, found, "found.toml")
    run = read(path)
    np.testing.assert_array_equal(run.columns[MASTER]["column_force"], found.middle.master["column_force"])
    for name, more in (("as_found", {}), ("other", {"column": {"stiffness": 1.0e7}})):
        measured(folder / f"{name}.mcap", found, **more)
    same = held.held(read(folder / "as_found.mcap"), run)
    assert same.held
    assert "The prediction held" in sentences.every(same)[0]
    other = held.held(read(folder / "other.mcap"), run)
    assert not other.held
    told = sentences.every(other)
    assert "Of the laboratories' readings column_" in told[1]
    assert "of the master was then still within the motion of the diagnosed recording" in told[3]
    assert "peaks lie in their bands; farthest outside: " in told[4]
    assert cli.guarded(lambda: held_code(folder, "other")) == 1
    assert "The prediction did not hold" in capsys.readouterr().out
    with pytest.raises(InputError, match="is itself a prediction"):
        held.held(run, run)
    with pytest.raises(InputError, match="is no prediction"):
        held.held(run, read(folder / "other.mcap"))


@pytest.mark.parametrize(
    ("kind", "factor"), [("offset", 0.4), ("drift", 0.3), ("size", -0.2), ("delay", 0.01), ("noise", 0.3)]
)
def test_the_shape_of_a_prediction_error_is_found(kind: str, factor: float) -> None:
    t = np.linspace(0.0, 6.0, 3001)
    median = np.sin(5.0 * t)[:, None]
    wrong = {
        "offset": np.full_like(median, factor),
        "drift": factor * t[:, None],
        "size": factor * median,
        "delay": -factor * 5.0 * np.cos(5.0 * t)[:, None],
        "noise": factor * np.random.default_rng(1).standard_normal(median.shape),
    }
    found = shape.shape_of(median + wrong[kind] + 1e-3 * np.cos(40.0 * t)[:, None], median, t)
    assert found.kind == kind
    assert found.factor == pytest.approx(factor, rel=0.05)
    assert found.share > 0.95
    assert shape.shape_of(median, median, t).kind == shape.NONE


FAR = {"beyond_seen": {"slave": {"ratio": 1.6, "since": 2.0}}}
ELSEWHERE = {"beyond_seen": {"slave": {"ratio": 1.0, "since": None, "energy_outside": 0.2}}}


@pytest.mark.parametrize(
    ("figures", "start", "kind", "says"),
    [
        (
            FAR,
            2.5,
            "size",
            "was then beyond the largest motion of the diagnosed recording, by up to 1.6 times",
        ),
        (FAR, 1.5, "delay", "was then still within the motion of the diagnosed recording"),
        (ELSEWHERE, 1.5, "", "moved at other frequencies than in the diagnosed recording"),
        (FAR, 2.5, "noise", "So the sensor is noisier than in the diagnosed recording."),
    ],
)
def test_a_signal_outside_its_band_is_reported_with_advice(
    figures: dict[str, Any], start: float, kind: str, says: str
) -> None:
    wrong = shape.ErrorShape(kind, 0.01, 0.9 if kind else 0.2)
    left = held.Departure(start, start + 1.0, 3.0)
    signal = held.HeldSignal("slave", 0.4, (left,), 3.0, start, "N", 9.0, wrong)
    told = sentences.every(held.Held(100, {"damper_force": signal}, 0.4, False, figures, False))
    assert "40 % of the time was inside its band, instead of 90 %" in told[0]
    assert f"damper_force left its band first, at t = {start:.2f} s" in told[1]
    assert ("No offset, drift" in told[2]) == (not kind)
    assert says in told[3]
    assert "have different plans" in told[-1]


def held_code(folder: Path, name: str) -> int:
    """The exit code of the comparison of a recording with the prediction."""
    import sys

    sys.argv = ["rths", "compare", str(folder / f"{name}.mcap"), "--predicted", str(folder / "next.mcap")]
    return main()


def test_a_test_and_its_prediction_are_overlaid_on_a_page_and_in_columns_of_a_file(
    folder: Path, found: Prediction, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    test, next_ = folder / "over.mcap", folder / "over_next.mcap"
    measured(test, found)
    file.write(next_, found, "found.toml")
    page, both = tmp_path / "over.html", tmp_path / "both.mcap"
    words = ["compare", str(test), "--predicted", str(next_), "--html", str(page), "-o", str(both)]
    monkeypatch.setattr("sys.argv", ["rths", *words])
    assert main() == 0
    text = page.read_text(encoding="utf-8")
    assert "The prediction held" in text
    assert text.count("data:image/png;base64,") == 2
    runs = {"": read(test), "predicted.": read(next_), "lower.": read(next_), "upper.": read(next_)}
    result = read(both)
    for prefix, run in runs.items():
        for topic in (MASTER, "slave"):
            source = topic if prefix in ("", "predicted.") else f"{prefix}{topic}"
            np.testing.assert_array_equal(result.log_ns[prefix + topic], runs[""].log_ns[topic])
            for name, values in run.columns[source].items():
                np.testing.assert_array_equal(result.columns[prefix + topic][name], values)
    assert main() == 2  # the files are there


def test_measured_signals_are_drawn_from_the_recording_and_not_from_the_prediction(
    folder: Path, found: Prediction
) -> None:
    test, next_ = folder / "drawn.mcap", folder / "drawn_next.mcap"
    measured(test, found)
    file.write(next_, found, "found.toml")
    shown = overlay.overlays(read(test), read(next_))
    assert [one.label for one in shown] == [
        "floor",
        "column displacement",
        "column force",
        "table acceleration",
        "damper force",
        "table displacement",
    ]
    force = shown[2]
    np.testing.assert_array_equal(force.measured, read(test).columns[MASTER]["column_force"])
    np.testing.assert_array_equal(force.middle, found.middle.master["column_force"])
    assert (force.low <= force.high).all()


def test_with_lost_messages_the_predicted_line_is_not_a_single_draw_of_losses(tmp_path: Path) -> None:
    plan = short()
    written(tmp_path, plan, effect=[{"name": "link.loss", "probability": 0.3, "burst": 20.0}])
    laboratories = draws.load(tmp_path / "found.toml", plan)
    middle = bands.predict(laboratories, plan, 30).middle.master["displacement"]
    other = [
        really(replace(laboratories.truth, seed=seed), noise=False).master["displacement"]
        for seed in range(100, 110)
    ]
    usual = np.mean(other, axis=0)
    assert np.std(middle - usual) < 0.7 * np.mean([np.std(one - usual) for one in other])


def test_if_the_found_laboratories_are_unstable_the_line_is_the_median_of_the_draws(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = short()

    def short_of_the_end(*words: Any) -> draws.Ensemble:
        result = draws.ensemble(*words)
        return result._replace(central=result.central._replace(finite=False, ticks=9, master={}, slaves={}))

    monkeypatch.setattr(bands, "ensemble", short_of_the_end)
    prediction = bands.predict(draws.load(folder / "found.toml", plan), plan, 20)
    assert prediction.middle.ticks == plan.ticks
    assert prediction.sentences[0].startswith("In the laboratories as found the test is unstable")


def test_a_prediction_for_another_building_leaves_out_the_first_buildings_parameters(tmp_path: Path) -> None:
    written(tmp_path, short(), structure={"stiffness": 26e6})
    heavier = tmp_path / "heavier.toml"
    heavier.write_text("[structure]\nmass = 200e3\n", encoding="utf-8")
    plan = plans.with_test(plans.load(heavier), duration=2.0)
    laboratories = draws.load(tmp_path / "found.toml", plan)
    assert laboratories.left_out == ("[structure]",)
    assert laboratories.truth.plan.structure == plan.structure
    with pytest.raises(PlanError, match="another building"):
        from_reality(tables(short(), structure={"stiffness": 26e6}), plan, tmp_path)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"noise": {"slave": {"damper_force": math.nan}}}, "Cannot read the uncertainty"),
        ({"rest": {"slave": {"damper_force": -1.0}}}, "Cannot read the uncertainty"),
        ({"covariance": np.zeros((3, 3))}, "Cannot read the uncertainty"),
        (
            {"noise": {"slave": {"damper_farce": 1.0}}},
            "of 'slave.damper_farce', which the plan does not have",
        ),
        ({"noise": {"slave.east": {"damper_force": 1.0}}}, "of 'slave.east.damper_force', which"),
        (
            {"parameters": (FRICTION, STIFFNESS._replace(parameter="column.stifness"))},
            "'master.column.stifness'",
        ),
    ],
)
def test_the_uncertainty_file_of_a_reality_is_checked(
    wrong: dict[str, Any], says: str, tmp_path: Path
) -> None:
    path = written(tmp_path, short())
    with (tmp_path / "found.npz").open("wb") as stream:
        np.savez(stream, **replace(SPREAD, **wrong).arrays())  # type: ignore[arg-type]
    with pytest.raises(PlanError, match=f"The reality .*found.toml: .*{says}"):
        draws.load(path, short())


def test_too_few_draws_are_refused_for_a_band(folder: Path) -> None:
    with pytest.raises(InputError, match="19 laboratories are too few for a band: draw at least 20"):
        bands.predict(draws.load(folder / "found.toml", short()), short(), 19)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('seed = 1\n[[effect]]\nname = "damper.friction"\nforce = 1.0\n', "does not hold the uncertainty"),
        ('[found]\nmodels = "0000000000000000"\nrest = "found.npz"\n', "other nominal models"),
        ('[found]\nrest = "none.npz"\n', "Cannot read the uncertainty"),
        ('[found]\nrest = "text.npz"\n', "Cannot read the uncertainty"),
        ('[found]\nrest = "empty.npz"\n', "Cannot read the uncertainty"),
        (
            '[found]\nrest = "found.npz"\n[[effect]]\nname = "damper.friction"\nforce = -1.0\n',
            "must be at least 0",
        ),
        ('[found]\nrest = "found.npz"\n[[effect]]\nname = "damper.frictoin"\n', "Unknown effect"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence_by_predict(text: str, says: str, tmp_path: Path) -> None:
    written(tmp_path, short())
    (tmp_path / "text.npz").write_text("no archive", encoding="utf-8")
    (tmp_path / "empty.npz").touch()
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=says):
        draws.load(path, short())
    with pytest.raises(InputError):
        draws.load(tmp_path / "missing.toml", short())
