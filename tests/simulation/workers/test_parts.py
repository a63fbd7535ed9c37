"""Finished rows of a table are kept, whatever ends the process that computes the others."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest
from pyarrow import parquet

from common.errors import InputError
from simulation.workers.batch import Batch
from simulation.workers.parts import Parts, Way, complete, parts, write

SCHEMA = pa.schema([pa.field("row", pa.int64()), pa.field("square", pa.float64(), metadata={"unit": "m²"})])
ABOUT = {"seed": 1}
TASKS = range(5)


def batch(number: int) -> Batch:
    rows = range(3 * number, 3 * number + 3)
    return Batch(number, {"row": list(rows), "square": [float(row) ** 2 for row in rows]})


def until(most: int) -> Callable[[int], Batch]:
    def compute(number: int) -> Batch:
        if number >= most:
            raise KeyboardInterrupt
        return batch(number)

    return compute


def made(
    path: Path, function: Callable[[int], Batch] = batch, about: dict[str, int] = ABOUT, force: bool = False
) -> bytes:
    with parts(path, about, SCHEMA, len(TASKS), force=force) as found:
        write(path, complete(found, function, TASKS, Way()), force=force)
    return path.read_bytes()


def test_a_table_is_complete_and_in_order_and_leaves_no_other_file(tmp_path: Path) -> None:
    made(tmp_path / "a.parquet")
    table = parquet.read_table(tmp_path / "a.parquet")
    assert table.column("row").to_pylist() == list(range(15))
    assert table.schema.field("square").metadata == {b"unit": b"m\xc2\xb2"}
    assert [path.name for path in tmp_path.iterdir()] == ["a.parquet"]


def test_finished_rows_are_not_computed_again(tmp_path: Path) -> None:
    whole = made(tmp_path / "a.parquet")
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "b.parquet", until(3))
    again: list[int] = []

    def counted(number: int) -> Batch:
        again.append(number)
        return batch(number)

    assert made(tmp_path / "b.parquet", counted) == whole
    assert again == [3, 4]


def test_a_part_that_was_being_written_is_ignored(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "b.parquet", until(2))
    folder = tmp_path / "b.parquet.parts"
    (folder / "0000002.new").write_bytes(b"half")
    assert Parts(folder, SCHEMA, 5).there == {0, 1}
    assert not (folder / "0000002.new").exists()


def test_a_batch_that_is_added_twice_is_kept_once(tmp_path: Path) -> None:
    with parts(tmp_path / "a.parquet", ABOUT, SCHEMA, 1) as found:
        found.add(batch(0))
        found.add(batch(0))
        assert found.table().num_rows == 3


def test_an_error_before_the_first_batch_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "a.parquet", until(0))
    assert list(tmp_path.iterdir()) == []


def test_rows_of_another_table_are_refused_or_replaced(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "a.parquet", until(2))
    with pytest.raises(
        InputError, match="computed with another seed: give another name for the table, or --force"
    ):
        made(tmp_path / "a.parquet", about={"seed": 2})
    assert made(tmp_path / "a.parquet", about={"seed": 2}, force=True) == made(
        tmp_path / "c.parquet", about={"seed": 2}
    )


def test_two_processes_do_not_write_one_table(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    with parts(path, ABOUT, SCHEMA, 1) as found:
        with pytest.raises(InputError, match="Another process is at work on"), parts(path, ABOUT, SCHEMA, 1):
            pass
        found.add(batch(0))
        assert json.loads((found.folder / "about.json").read_text()) == ABOUT
