"""Effects that the data cannot tell apart; every name counts once."""

from __future__ import annotations

import numpy as np

from diagnosis.findings.verdict import equivalents
from diagnosis.fits.fitting import Fit
from diagnosis.fits.search import Search
from tests.diagnosis.specimens import MadeSpecimen, data_of

DATA = data_of(MadeSpecimen())
NOISY = np.random.default_rng(3).standard_normal((DATA.groups, 1))


def fit(names: str, apart: float) -> Fit:
    """A fit with effects of these names, whose residuals differ so much from those of the chosen one."""
    moved = NOISY + apart * np.eye(1, DATA.groups).T
    return Fit(DATA, {name: {} for name in names}, np.zeros(0), moved)


def search(*others: Fit) -> Search:
    return Search(DATA, fit("", 9.0), fit("ab", 0.0), others)


def test_an_effect_that_is_equivalent_to_two_counts_for_the_one_that_it_matches_best() -> None:
    assert equivalents(search(fit("cb", 0.2), fit("ac", 0.1), fit("db", 0.1))) == (("b", "c"), ("a", "d"))


def test_two_forms_of_an_effect_count_as_one_name() -> None:
    assert equivalents(search(fit("cb", 0.2), fit("cb", 0.1))) == (("a", "c"),)


def test_an_effect_that_fits_worse_is_not_equivalent() -> None:
    worse = fit("cb", 0.0)
    assert equivalents(search(Fit(DATA, worse.values, worse.z, NOISY + 0.2))) == ()
