"""FMUs in both directions: a laboratory in FMPy, an FMU as a rig or a specimen in the loop, and refused ones."""

from __future__ import annotations

import shutil
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError, RigError
from common.plan.read import parse
from common.reality.reality import as_planned, from_reality
from common.recording.reader import read
from common.recording.run import Run
from common.rig import ColumnCommand, command_of
from common.roles import MASTER
from common.signals import COLUMN_CHANNELS, Signal
from loop import rigs
from rths.fmi import Rig, Specimen, build
from rths.fmi.rig import Fmu
from simulation import virtual
from tests.helpers import ROOT

REASON = "FMPy is not installed: make fmi"
with_fmpy = pytest.mark.skipif(find_spec("fmpy") is None or find_spec("lxml") is None, reason=REASON)
compiled = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler on this machine")
TEXT = "[test]\nduration = 0.6\n[ground_motion]\nscale = 2.0\n"
REALITY = 'seed = 9\n[[effect]]\nname = "column.friction"\nforce = 900.0\n'
ELASTIC = """
import os, struct, sys
out = os.dup(1)
source = sys.stdin.buffer
position = 0.0
while order := source.read(1):
    if order == b"S":
        source.read(8)
    else:
        (position,) = struct.unpack("<d", source.read(8))
    if position > 1.0:
        os.write(out, b"\\1" + struct.pack("<H", 10) + b"it is torn")
    os.write(out, b"\\0" + struct.pack("<d", 12.5e6 * position))
"""


@pytest.fixture(scope="module")
def laboratories(tmp_path_factory: pytest.TempPathFactory, make: Any) -> dict[str, Path]:
    """FMUs of both laboratories of a plan, and of a column with an effect."""
    folder = tmp_path_factory.mktemp("fmu")
    (folder / "plan.toml").write_text(TEXT)
    (folder / "reality.toml").write_text(REALITY)
    found = {}
    for name, more in (
        ("master", []),
        ("slave", ["--lab", "slave"]),
        ("rubbing", ["--reality", folder / "reality.toml"]),
    ):
        found[name] = folder / f"{name}.fmu"
        assert make("export", folder / "plan.toml", "-o", found[name], *more) == 0
    return found


@pytest.fixture(scope="module")
def make() -> Any:
    from rths.__main__ import parser_for
    from rths.examine import export

    def run(_verb: str, *words: object) -> int:
        return export.run(parser_for("export").parse_args([str(word) for word in words]))

    return run


def commands(count: int, width: int) -> Any:
    return 2e-3 * np.sin(np.arange(count)[:, None] * np.linspace(0.02, 0.05, width))


def by_rig(role: str, tables: dict[str, Any], rows: Any) -> list[tuple[float, ...]]:
    """The readings of the rig itself: before the first command, and after each."""
    plan = parse(TEXT, ROOT)
    reality = (from_reality(tables, plan, ROOT) if tables else as_planned(plan)).of(role)
    rig, kind = rigs.build(reality, role), rigs.hosted(reality, role)
    assert kind
    rig.arm()
    found = [tuple(rig.read())]
    for row in rows.tolist():
        rig.write(command_of(kind.channels)(*row))
        found.append(tuple(rig.read()))
    return found


RUBBING = {"seed": 9, "effect": [{"name": "column.friction", "force": 900.0}]}


@with_fmpy
@compiled
@pytest.mark.parametrize(
    ("name", "role", "tables"), [("master", MASTER, {}), ("slave", "slave", {}), ("rubbing", MASTER, RUBBING)]
)
def test_a_laboratory_as_an_fmu_passes_the_checker_and_gives_the_rigs_bits(
    name: str, role: str, tables: dict[str, Any], laboratories: dict[str, Path]
) -> None:
    from fmpy import simulate_fmu
    from fmpy.validation import validate_fmu

    file = str(laboratories[name])
    assert validate_fmu(file) == []
    kind = rigs.hosted(as_planned(parse(TEXT, ROOT)), role)
    assert kind
    rows = commands(50, len(kind.channels.drives))
    given = np.zeros(50, dtype=[(one, float) for one in ("time", *kind.channels.drives)])
    given["time"] = np.arange(50) * 0.002
    for place, one in enumerate(kind.channels.drives):
        given[one] = rows[:, place]
    found = simulate_fmu(file, start_time=0.0, stop_time=0.098, output_interval=0.002, input=given)
    expected = by_rig(role, tables, rows[:49])
    assert found.dtype.names == ("time", *kind.channels.names)
    assert [tuple(row)[1:] for row in found.tolist()] == expected


@with_fmpy
@compiled
def test_an_fmu_with_another_seed_has_different_noise(laboratories: dict[str, Path]) -> None:
    found = []
    for seed in (1, 1, 2):
        fmu = Fmu(str(laboratories["master"]), 0.002, (), (), {"seed": seed})
        fmu.begin()
        found.append(fmu.outputs())
        fmu.end()
    assert found[0] == found[1] != found[2]


def played(path: Path, **tables: Any) -> Run:
    plan = parse(TEXT, path.parent)
    reality = from_reality(tables, plan, path.parent) if tables else as_planned(plan)
    assert virtual.run(virtual.assemble(plan, reality, path), str) is None
    return read(path)


def differing(one: Run, other: Run) -> list[str]:
    """The signals of which any bit differs."""
    return [
        f"{topic}/{name}"
        for topic in ("master", "slave")
        for name, values in one.columns[topic].items()
        if not np.array_equal(values, other.columns[topic][name])
    ]


@with_fmpy
@compiled
def test_a_loop_with_fmus_as_rigs_gives_the_bits_of_the_emulated_loop(
    laboratories: dict[str, Path], tmp_path: Path
) -> None:
    from_fmus = {
        role: {"rig": {"class": "rths.fmi:Rig", "options": {"file": str(laboratories[role])}}}
        for role in ("master", "slave")
    }
    assert differing(played(tmp_path / "a.mcap"), played(tmp_path / "b.mcap", **from_fmus)) == []


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU of an elastic specimen, a program of its own."""
    path = tmp_path_factory.mktemp("elastic") / "elastic.fmu"
    wanted = build.AskedFor(
        "elastic",
        "an elastic column",
        [Signal("deformation", "m", "deformation")],
        [Signal("force", "N", "force")],
        0.002,
        1,
        1.0,
        (sys.executable, "-c", f"exec({ELASTIC!r})"),  # a word of the command is one line
        {},
    )
    build.build(wanted, path)
    return path


@with_fmpy
@compiled
def test_a_loop_with_a_specimen_in_an_fmu_gives_the_bits_of_the_emulated_column(
    elastic: Path, tmp_path: Path
) -> None:
    rig = {"class": "rths.fmi:Specimen", "options": {"file": str(elastic)}}
    assert differing(played(tmp_path / "a.mcap"), played(tmp_path / "b.mcap", master={"rig": rig})) == []


@with_fmpy
@compiled
def test_an_fmu_that_fails_ends_the_test_and_a_step_other_than_the_interval_is_refused(elastic: Path) -> None:
    rig = Specimen(0.002, 1, str(elastic), actuator={"delay": 0.0, "gain": 1e6})
    rig.arm()
    rig.write(ColumnCommand(0.0))
    with pytest.raises(RigError, match=r"the FMU elastic.fmu failed: it is torn"):
        rig.write(ColumnCommand(1.0))
    rig.disarm()
    other = Specimen(0.003, 1, str(elastic))
    other.arm()
    with pytest.raises(
        RigError, match=r"The communication step is no multiple of the laboratory's interval\."
    ):
        other.write(ColumnCommand(0.0))
    other.disarm()


@with_fmpy
@compiled
def test_an_invalid_fmu_or_one_that_lacks_a_variable_is_refused(elastic: Path, tmp_path: Path) -> None:
    (tmp_path / "no.fmu").write_text("no archive")
    with zipfile.ZipFile(tmp_path / "empty.fmu", "w") as archive:
        archive.writestr("readme", "")
    second = (
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><ModelVariables/></fmiModelDescription>'
    )
    with zipfile.ZipFile(tmp_path / "second.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", second)
    with zipfile.ZipFile(tmp_path / "broken.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", second.replace("2.0", "3.0"))
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("nowhere.fmu", {}, "There is no FMU nowhere.fmu: give the path"),
        (
            str(tmp_path / "no.fmu"),
            {},
            r"cannot be read as an FMU \(File is not a zip file\): export it by FMI 3.0",
        ),
        (str(tmp_path / "empty.fmu"), {}, "cannot be read as an FMU"),
        (
            str(tmp_path / "second.fmu"),
            {},
            "second.fmu is of FMI 2.0: export it by FMI 3.0 for co-simulation.",
        ),
        (
            str(tmp_path / "broken.fmu"),
            {},
            r"^[^\n]*broken.fmu cannot be read as an FMU \([^\n]*\): export it[^\n]*$",
        ),
        (str(elastic), {}, "do not have the names of a kind's channels: give inputs and outputs"),
        (str(elastic), {"inputs": ["deformation"], "outputs": ["froce"]}, "has no variable 'froce': it has"),
    ]
    for file, options, text in cases:
        with pytest.raises(InputError, match=text):
            Rig(0.002, 1, file, **options)


@with_fmpy
@compiled
def test_an_fmu_for_another_platform_is_refused(elastic: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(elastic) as archive, zipfile.ZipFile(tmp_path / "other.fmu", "w") as other:
        other.writestr("modelDescription.xml", archive.read("modelDescription.xml"))
    rig = Specimen(0.002, 1, str(tmp_path / "other.fmu"))
    with pytest.raises(RigError, match=r"the FMU other.fmu cannot be started"):
        rig.arm()
    rig.disarm()


def test_without_fmpy_the_message_states_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy", None)
    with pytest.raises(InputError, match=r"because fmpy is not installed: `make fmi` installs FMPy\."):
        Rig(0.002, 1, str(tmp_path / "a.fmu"))


def test_an_impossible_fmu_export_is_refused(
    call: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "a.fmu"
    assert call("export", "default", "-o", out, "--lab", "roof") == 2
    assert call("export", "single_site", "-o", out, "--lab", "slave") == 2
    monkeypatch.setenv("PATH", str(tmp_path))
    assert call("export", "default", "-o", out) == 2
    assert not out.exists()


def test_channels_have_their_units_in_a_model_description() -> None:
    units = {row.unit for row in (COLUMN_CHANNELS.command, *COLUMN_CHANNELS.measured)}
    assert units <= build.EXPONENTS.keys()
