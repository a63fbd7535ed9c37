"""Nominal parameters that are farther off than usual: from where on chance is no explanation, and what is said then."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from common.recording.reader import read
from diagnosis.fits import worth
from diagnosis.fits.fitting import Fit
from rths.examine.diagnose import diagnosed
from tests.diagnosis import cases as made


def bare(*z: float, names: tuple[str, ...] = ()) -> Fit:
    """A fit with nominal parameters that are z tolerances off, and nothing to fit."""
    data = SimpleNamespace(judging=np.ones(0, dtype=bool), train=np.zeros(0, dtype=bool))
    return Fit(data, {name: {} for name in names}, np.array(z), np.zeros((0, 1)))  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [3, 4, 7])
def test_few_clean_laboratories_are_searched_for_effects(count: int) -> None:
    draws = np.random.default_rng(count).standard_normal((4000, count))
    searched = np.mean([worth.strained(bare(*z)) for z in draws])
    # beyond what one in fifty exceeds, and of a few parameters what one alone may be off
    assert 0.01 < searched < 0.035


@pytest.mark.parametrize("names", [(), ("column.slip",)])
def test_all_parameters_may_be_off_as_chance_has_them_or_one_alone(names: tuple[str, ...]) -> None:
    assert not worth.strained(bare(*(1.5,) * 7, names=names))
    assert worth.strained(bare(*(1.6,) * 7, names=names))
    assert not worth.strained(bare(2.9, names=names))
    assert worth.strained(bare(3.0, names=names))


@pytest.mark.long
@pytest.mark.parametrize(("z", "warned"), [(2.0, False), (2.9, True)])
def test_a_parameter_that_is_rarely_as_far_off_is_told_and_not_named(
    tmp_path: Path, z: float, warned: bool
) -> None:
    base = made.short(6.0)
    made.play(base, made.tables(base, {}, {"column.stiffness": z}, 3), tmp_path / "a.mcap")
    report = next(iter(diagnosed(read(tmp_path / "a.mcap"))[0].values()))
    assert report.status == "within_tolerances"
    told = [warning for warning in report.warnings if warning.startswith("column.stiffness is 2.")]
    assert bool(told) is warned
    assert all(warning.endswith("measure it again, or state a wider tolerance.") for warning in told)
