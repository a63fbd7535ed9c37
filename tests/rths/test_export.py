"""The files of `rths export`, read by other programs' libraries."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from pyarrow import parquet
from scipy.io import loadmat

from common import signals
from common.recording.reader import read
from common.recording.run import Run
from common.recording.writer import Recording
from rths.examine import export
from tests.rths import extremes


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return extremes.write(tmp_path_factory.mktemp("recordings") / "extremes.mcap")


def of_csv(path: Path) -> dict[str, Any]:
    frame = pandas.read_csv(path)
    return {name: frame[name].to_numpy() for name in frame.columns}


def of_parquet(path: Path) -> dict[str, Any]:
    frame = pandas.read_parquet(path)
    return {name: frame[name].to_numpy() for name in frame.columns}


def of_mat(path: Path) -> dict[str, Any]:
    items = loadmat(path, squeeze_me=True)
    return {name: item for name, item in items.items() if name not in ("units", "events") and name[0] != "_"}


READERS = {".csv": of_csv, ".parquet": of_parquet, ".mat": of_mat}


@pytest.mark.parametrize("suffix", READERS)
def test_another_library_reads_every_column_to_the_last_bit(
    suffix: str, call: Any, recording: Path, virtual_recording: Path, tmp_path: Path
) -> None:
    for source in (recording, virtual_recording):
        out = tmp_path / f"{source.stem}{suffix}"
        assert call("export", source, "-o", out) == 0
        returned, wanted = READERS[suffix](out), export.flat(read(source))
        assert list(returned) == list(wanted)
        for name, column in wanted.items():
            same_bits(returned[name], as_in(suffix, column), name)


def as_in(suffix: str, column: Any) -> Any:
    """A column in the types of a format: MAT has no booleans, CSV no widths of integers."""
    if column.dtype.kind == "b" and suffix == ".mat":
        return column.astype(np.uint8)
    return column.astype(np.int64) if column.dtype.kind == "i" and suffix == ".csv" else column


def same_bits(got: Any, wanted: Any, name: str) -> None:
    assert got.dtype == wanted.dtype, name
    if wanted.dtype.kind == "f":  # any NaN is as good as another
        assert np.array_equal(np.isnan(got), np.isnan(wanted)), name
        got, wanted = (np.where(np.isnan(column), 0.0, column) for column in (got, wanted))
    assert got.tobytes() == wanted.tobytes(), name


def test_columns_equal_those_of_the_recording_with_nan_for_missing_values(recording: Path) -> None:
    found, columns = read(recording), export.flat(read(recording))
    assert all(column.shape == (extremes.TICKS,) for column in columns.values())
    assert np.isnan(columns["slave_cellar_damper_force"][-1])
    assert columns["slave_cellar_command_seq"][-1] == 0
    for topic, named in found.columns.items():
        for name, column in named.items():
            for place, part in enumerate(column.T if column.ndim == 2 else [column]):
                number = f"_{place + 1}" if column.ndim == 2 else ""
                exported = columns["seq" if name == "seq" else f"{topic.replace('.', '_')}_{name}{number}"]
                assert exported[: part.size].tobytes() == part.tobytes()


def test_columns_are_exported_with_their_units(
    call: Any, capsys: Any, recording: Path, tmp_path: Path
) -> None:
    assert call("export", recording, "-o", tmp_path / "a.parquet", "--json") == 0
    said = json.loads(capsys.readouterr().out)["units"]
    assert said == wanted_units(read(recording))
    schema = parquet.read_schema(tmp_path / "a.parquet")
    in_parquet = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}
    assert {name: unit for name, unit in in_parquet.items() if unit} == said
    assert call("export", recording, "-o", tmp_path / "a.mat") == 0
    units = loadmat(tmp_path / "a.mat", squeeze_me=True)["units"]
    assert {name: str(units[name]) for name in units.dtype.names} == said


def wanted_units(found: Run) -> dict[str, str]:
    units = {}
    for name in export.flat(found):
        for topic in sorted(found.columns, key=len):
            flat = topic.replace(".", "_")
            for field in found.columns[topic]:
                if name.removeprefix(f"{flat}_").removesuffix("_1").removesuffix("_2") == field:
                    units[name] = found.units[topic][field]
    return {name: unit for name, unit in units.items() if unit}


def events_beside(path: Path) -> Path:
    return path.with_stem(f"{path.stem}-events")


def rows_of_csv(path: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = pandas.read_csv(events_beside(path)).to_dict("records")
    return rows


def rows_of_parquet(path: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = pandas.read_parquet(events_beside(path)).to_dict("records")
    return rows


def rows_of_mat(path: Path) -> list[dict[str, Any]]:
    table = loadmat(path, squeeze_me=True)["events"]
    return [dict(zip(table.dtype.names, row.tolist(), strict=True)) for row in np.atleast_1d(table)]


@pytest.mark.parametrize("suffix", READERS)
def test_exported_events_are_read_back(
    suffix: str, call: Any, recording: Path, virtual_recording: Path, tmp_path: Path
) -> None:
    rows: dict[str, Callable[[Path], list[dict[str, Any]]]] = {
        ".csv": rows_of_csv,
        ".parquet": rows_of_parquet,
        ".mat": rows_of_mat,
    }
    for source in (recording, virtual_recording):
        out = tmp_path / f"{source.stem}{suffix}"
        assert call("export", source, "-o", out, "--events") == 0
        returned = [{**row, "values": json.loads(row["values"])} for row in rows[suffix](out)]
        assert returned == read(source).events


def test_without_the_option_for_events_one_file_is_written(
    call: Any, recording: Path, tmp_path: Path
) -> None:
    assert call("export", recording, "-o", tmp_path / "a.csv") == 0
    assert call("export", recording, "-o", tmp_path / "b.mat", "--events") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b.mat"]


def test_a_name_that_is_too_long_for_matlab_is_refused_in_one_sentence(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    slave = "slave." + "a" * 60
    topics = signals.default_topics((slave,))
    written = Recording(tmp_path / "long.mcap", "long", 1, {slave: topics[slave]}, (slave,))
    written.add(slave, 0, 0, [extremes.value(row, 0) for row in topics[slave]])
    written.close({})
    assert call("export", tmp_path / "long.mcap", "-o", tmp_path / "a.mat") == 2
    said = capsys.readouterr().err
    assert "MATLAB has no name as long as" in said
    assert said.count("\n") == 1
    assert call("export", tmp_path / "long.mcap", "-o", tmp_path / "a.csv") == 0


def test_a_recording_without_ticks_is_refused_in_one_sentence(call: Any, capsys: Any, tmp_path: Path) -> None:
    written = Recording(tmp_path / "none.mcap", "none", 1, {"event": signals.EVENT})
    written.add("event", 0, 0, [0.0, "master", "error", "refused", "no", {}])
    written.close({})
    assert call("export", tmp_path / "none.mcap", "-o", tmp_path / "a.csv") == 2
    assert "holds no ticks to export" in capsys.readouterr().err
