from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from common import tables
from common.errors import InputError, RigError
from common.limits import Guard
from common.plugins import construct, find
from common.rig import ColumnCommand, ColumnMeasurement, GuardedRig


class Fake:
    """A rig that does what it is told to."""

    def __init__(self, reading: Any = (0.0, 0.0), error: Exception | None = None) -> None:
        self.reading, self.error = reading, error
        self.written: list[Any] = []

    def _fail(self) -> None:
        if self.error:
            raise self.error

    def arm(self) -> None:
        self._fail()

    def read(self) -> Any:
        self._fail()
        return self.reading

    def write(self, command: Any) -> None:
        self._fail()
        self.written.append(command)

    def disarm(self) -> None:
        self._fail()


def guarded(**options: Any) -> GuardedRig:
    return GuardedRig(Fake(**options), "laboratory A (Fake)", ColumnMeasurement)


def test_a_good_reading_becomes_a_measurement() -> None:
    assert guarded(reading=[1, 2.5]).read() == ColumnMeasurement(1.0, 2.5)


@pytest.mark.parametrize(
    ("reading", "sentence"),
    [
        ((1.0,), "returned 1 numbers, not 2 (column_displacement, column_force)"),
        ((1.0, 2.0, 3.0), "returned 3 numbers, not 2"),
        ((1.0, math.nan), "not finite"),
        ((math.inf, 0.0), "not finite"),
        (None, "returned None, not numbers"),
        (("a", 1.0), "not numbers"),
    ],
)
def test_a_wrong_reading_is_a_sentence_that_names_the_rig(reading: Any, sentence: str) -> None:
    with pytest.raises(RigError) as error:
        guarded(reading=reading).read()
    assert str(error.value).startswith("laboratory A (Fake): read() ")
    assert sentence in str(error.value)


def test_whatever_a_rig_raises_is_a_sentence_that_names_it() -> None:
    rig = guarded(error=ZeroDivisionError("division by zero"))
    for call, word in (
        (rig.arm, "arm"),
        (rig.read, "read"),
        (lambda: rig.write(ColumnCommand(0.0)), "write"),
    ):
        with pytest.raises(RigError, match=rf"laboratory A \(Fake\): {word}\(\) failed: ZeroDivisionError"):
            call()
    assert rig.disarm() == "laboratory A (Fake): disarm() failed: ZeroDivisionError: division by zero"
    with pytest.raises(RigError, match=r"laboratory A \(Fake\): the pump is off"):
        guarded(error=RigError("the pump is off")).arm()


def test_a_class_is_found_in_a_file_and_in_a_module(tmp_path: Path) -> None:
    (tmp_path / "lab.py").write_text("class Lab:\n    def __init__(self, a):\n        self.a = a\n")
    kind = find("lab.py:Lab", tmp_path, "[master.rig]")
    assert construct(kind, {"a": 3}, "[master.rig]").a == 3
    assert find("common.rig:GuardedRig", tmp_path, "[master.rig]") is GuardedRig


@pytest.mark.parametrize(
    ("reference", "sentence"),
    [
        ("lab.py", "must be 'file.py:Class' or 'package.module:Class'"),
        ("missing.py:Lab", "There is no file"),
        ("lab.py:Nothing", "has no class 'Nothing'"),
        ("broken.py:Lab", r"Cannot load 'broken.py' named in \[master.rig\]: SyntaxError"),
        ("no.such.module:Lab", "Cannot load 'no.such.module'"),
    ],
)
def test_a_class_that_cannot_be_had_is_a_sentence(tmp_path: Path, reference: str, sentence: str) -> None:
    (tmp_path / "lab.py").write_text("class Lab:\n    pass\n")
    (tmp_path / "broken.py").write_text("class Lab\n")
    with pytest.raises(InputError, match=sentence):
        find(reference, tmp_path, "[master.rig]")


def test_options_that_do_not_fit_are_a_sentence() -> None:
    with pytest.raises(InputError, match=r"Cannot construct Fake named in \[master.rig\].*colour"):
        construct(Fake, {"colour": 1}, "[master.rig]")


def test_limits_apply_by_name_and_take_no_nan() -> None:
    guard = Guard(tables.Limits(column_force=10.0), ColumnMeasurement._fields)
    assert guard.violation((0.0, 10.0)) is None
    assert str(guard.violation((0.0, -10.1))) == "column_force is -10.1, beyond its limit of 10 N."
    assert "column_displacement is nan" in str(guard.violation((math.nan, 0.0)))


def test_limits_apply_to_every_storey() -> None:
    guard = Guard(tables.Limits(displacement=1.0), ("displacement", "other"), several=("displacement",))
    assert guard.violation(([0.5, 1.0], 99.0)) is None
    assert str(guard.violation(([0.5, -1.5], 0.0))) == "displacement is -1.5, beyond its limit of 1 m."
