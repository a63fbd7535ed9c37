"""Static data, whose rows have an order but no times: the report knows no seconds, no hertz and no rates."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.rths.report.pages import Balanced

STIFF = 16.0  # kN/mm, of a specimen that the default plan believes to have 12.5
TIME = re.compile(r"\d [mµ]?s\b|\bHz\b|\bseconds?\b")


def cycles(path: Path) -> None:
    """Write cycles of growing amplitude with noise, one row after the other, in mm and kN."""
    corners = [0.0, *(sign * size for size in (2.0, 4.0, 6.0, 8.0) for sign in (1.0, -1.0, 1.0, -1.0)), 0.0]
    y = np.concatenate([np.linspace(*ends, 40, endpoint=False) for ends in itertools.pairwise(corners)])
    draw = np.random.default_rng(1)
    force = STIFF * y + 2.0 * np.sign(np.gradient(y)) + 0.1 * draw.standard_normal(y.size)
    path.write_text("y,f\n" + "".join(f"{a:.4f},{b:.3f}\n" for a, b in zip(y, force, strict=True)))


@pytest.mark.slow
def test_a_report_on_static_data_holds_no_times_and_no_effects_on_rates(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    cycles(tmp_path / "a.csv")
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\nstatic = true\n[signals]\ncolumn_displacement = { column = "y", unit = "mm" }\n'
        'column_force = { column = "f", unit = "kN" }\n'
    )
    (tmp_path / "plan.toml").write_text('[test]\ninterval = 0.01\n[compensator]\nkind = "none"\n')
    recording, out, html = (tmp_path / name for name in ("a.mcap", "a.json", "a.html"))
    assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", recording) == 0
    imported = capsys.readouterr().out
    assert "680 rows without times" in imported
    assert not TIME.findall(imported)
    assert call("inspect", recording) == 0
    inspected = capsys.readouterr().out
    assert not TIME.findall(inspected)
    assert "force path" not in inspected
    assert call("diagnose", recording, "--json", out, "--html", html) == 0
    text = capsys.readouterr().out
    (named,) = re.findall(r"at the column: ([a-z+ ]+) closes", " ".join(text.split()))
    assert set(named.split(" + ")) == {"column friction", "column stiffness"}  # not the gain of the load cell
    assert "rows between those used for fitting" in text
    assert not TIME.findall(text)
    page = html.read_text(encoding="utf-8")
    assert "680 rows" in page
    assert not TIME.findall(" ".join(Balanced(page).words))
    report = json.loads(out.read_text(encoding="utf-8"))
    assert [(place["when"], place["frequency_band"]) for place in report["where"]] == [([], None)]
    assert set(np.diff(report["details"]["histories"][0]["t"])) == {1.0}
    assert {"column.viscous", "column.inertia", "sensor.column_force.lag"} <= set(report["not_exercised"])
    tried = {name for item in report["details"]["candidates"] for name in item["effects"]}
    assert not tried & {
        "column.viscous",
        "column.inertia",
        "sensor.column_force.lag",
        "sensor.column_force.delay",
    }
