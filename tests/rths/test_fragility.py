"""`rths fragility`: curves of a table with known probabilities, and refusals in one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A sweep whose peak exceeds 20 mm with the probability of a lognormal curve (median 0.8 m/s², dispersion 0.4)."""
    random = np.random.default_rng(1)
    pga = np.repeat(np.linspace(0.2, 2.0, 10), 200)
    peak = 0.02 * pga / 0.8 * np.exp(0.4 * random.standard_normal(pga.size))
    metres = pa.field("peak_drift", pa.float64(), metadata={"unit": "m"})
    schema = pa.schema(
        [pa.field("pga", pa.float64(), metadata={"unit": "m/s²"}), metres, ("compensator", pa.string())]
    )
    path = tmp_path / "sweep.parquet"
    parquet.write_table(pa.table([pga, peak, ["pid"] * pga.size], schema=schema), path)
    return path


def test_the_fragility_curve_agrees_with_the_known_one(
    call: Callable[..., int], table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("fragility", table, "--quantity", "peak_drift", "--limit", "20 mm", "--by", "compensator")
    assert call(*words, "--json", "-") == 0
    found = json.loads(capsys.readouterr().out)
    (curve,) = found["curves"]
    assert curve["median"] == pytest.approx(0.8, rel=0.05)
    assert curve["dispersion"] == pytest.approx(0.4, rel=0.1)
    assert curve["agreement"] > 0.01
    assert call(*words) == 0
    out = capsys.readouterr().out
    assert "chance that peak_drift passes 20.0 mm, against pga" in out
    assert "pid" in out
    assert "m/s² (" in out


def test_a_limit_that_no_test_exceeds_has_no_curve(
    call: Callable[..., int], table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("fragility", table, "--quantity", "peak_drift", "--limit", "9 m") == 1
    assert "No curve: the limit is passed in no test." in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--quantity", "peak_drft", "--limit", "1"), "has no column 'peak_drft': did you mean peak_drift?"),
        (("--quantity", "compensator", "--limit", "1"), "is no column of numbers"),
        (("--quantity", "peak_drift", "--limit", "-1"), "--limit is -1, but must be above 0."),
        (("--quantity", "peak_drift", "--limit", "20 kg"), "--limit"),
    ],
)
def test_impossible_arguments_of_fragility_are_refused_in_one_sentence(
    call: Callable[..., int],
    table: Path,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    complaint: str,
) -> None:
    assert call("fragility", table, *words[:2], f"{words[2]}={words[3]}") == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_a_file_that_is_not_a_sweep_table_is_refused(
    call: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--quantity", "peak_drift", "--limit", "1")
    assert call("fragility", tmp_path / "no.parquet", *words) == 2
    assert "There is no file" in capsys.readouterr().err
    (tmp_path / "no.parquet").write_text("[test]\n")
    assert call("fragility", tmp_path / "no.parquet", *words) == 2
    assert "is no Parquet file: give the table that rths sweep wrote." in capsys.readouterr().err
