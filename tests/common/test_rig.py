from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.errors import InputError, RigError
from common.plan import laboratory_tables
from common.plan.plan import Plan
from common.plan.plugins import construct, find
from common.reality.reality import as_planned
from common.rig import METHODS, ColumnCommand, ColumnMeasurement, GuardedRig
from loop.links import link_model


class Fake:
    """A rig whose readings and errors a test sets."""

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
def test_a_wrong_reading_gives_one_sentence_that_names_the_rig(reading: Any, sentence: str) -> None:
    with pytest.raises(RigError) as error:
        guarded(reading=reading).read()
    assert str(error.value).startswith("laboratory A (Fake): read() ")
    assert sentence in str(error.value)


def test_any_exception_of_a_rig_gives_one_sentence_that_names_it() -> None:
    rig = guarded(error=ZeroDivisionError("division by zero"))
    for call, word in (
        (rig.arm, "arm"),
        (rig.read, "read"),
        (lambda: rig.write(ColumnCommand(0.0)), "write"),
    ):
        with pytest.raises(RigError, match=rf"laboratory A \(Fake\): {word}\(\) failed: ZeroDivisionError"):
            call()
    assert "laboratory A (Fake): disarm() failed: ZeroDivisionError: division by zero" in str(rig.disarm())
    with pytest.raises(RigError, match=r"laboratory A \(Fake\): the pump is off"):
        guarded(error=RigError("the pump is off")).arm()


FAULTY = """
class Lab:
    def __init__(self, interval=0.1, seed=1, setting=None):
        self.setting = {"gain": 1.0} if setting is None else setting
        self.gain = self.setting["gain"]
    def arm(self): self.scale("a")
    def read(self): self.scale("r")
    def write(self, command): raise SystemExit(1)
    def disarm(self): self.scale("d")
    def scale(self, name):
        return self.setting[name]  # line 11
"""


def test_an_exception_of_a_rig_is_located_in_its_own_file(tmp_path: Path) -> None:
    (tmp_path / "lab.py").write_text(FAULTY)
    kind = find("lab.py:Lab", tmp_path, "[master.rig]")
    rig = GuardedRig(construct(kind, {}, "[master.rig]", METHODS), "laboratory A (Lab)", ColumnMeasurement)
    for call, sentence in (
        (rig.arm, "arm() failed: KeyError: 'a'"),
        (rig.read, "read() failed: KeyError: 'r'"),
    ):
        with pytest.raises(RigError) as error:
            call()
        assert str(error.value) == f"laboratory A (Lab): {sentence} (lab.py, line 11)"
        assert 'lab.py", line 11, in scale' in error.value.details
    assert str(rig.disarm()).endswith("disarm() failed: KeyError: 'd' (lab.py, line 11)")
    with pytest.raises(RigError, match=r"write\(\) failed: SystemExit: 1 \(lab.py, line 8\)"):
        rig.write(ColumnCommand(0.0))
    with pytest.raises(InputError, match=r"Cannot construct Lab .*: KeyError: 'gain' \(lab.py, line 5\)"):
        construct(kind, {"setting": {}}, "[master.rig]", METHODS)
    hidden = GuardedRig(kind(), "laboratory A", ColumnMeasurement, hidden=True)
    with pytest.raises(RigError, match=r"^laboratory A: read\(\) failed: KeyError\.$") as error:
        hidden.read()
    assert not error.value.details


@pytest.mark.parametrize(
    ("methods", "sentence"),
    [
        ("arm read write", "Lab (lab.py) named in [master.rig] lacks a method, but must have disarm()"),
        ("arm read disarm", "lacks a method, but must have write(command)"),
        ("arm read write=3 disarm", "has 3 for a method, but must have write(command)"),
        ("arm read write() disarm", "has a method with other parameters (too many positional arguments)"),
        ("arm read(channel) write disarm", "(missing a required argument: 'channel'), but must have read()"),
        ("arm async_read write disarm", "has an async method, which is never awaited, but must have read()"),
    ],
)
def test_a_rig_that_lacks_a_method_is_refused_when_it_is_loaded(
    tmp_path: Path, methods: str, sentence: str
) -> None:
    lines = ["class Lab:"]
    for word in methods.split():
        name, equals, value = word.partition("=")
        plain = name.partition("(")[0]
        given = name.partition("(")[2].rstrip(")") if "(" in name else "command" if plain == "write" else ""
        kind, plain = ("async def", plain[6:]) if plain.startswith("async_") else ("def", plain)
        own = f"self, {given}" if given else "self"
        lines.append(f"    {plain} = {value}" if equals else f"    {kind} {plain}({own}): pass")
    (tmp_path / "lab.py").write_text("\n".join(lines))
    kind_of_lab = find("lab.py:Lab", tmp_path, "[master.rig]")
    with pytest.raises(InputError) as error:
        construct(kind_of_lab, {}, "[master.rig]", METHODS)
    assert sentence in str(error.value)


def test_methods_that_a_rig_delegates_are_accepted() -> None:
    class Wrapped:
        def __init__(self) -> None:
            self.inner = Fake()
            self.write = self.inner.write

        def __getattr__(self, name: str) -> Any:
            return getattr(self.inner, name)

    assert construct(Wrapped, {}, "[master.rig]", METHODS).read() == (0.0, 0.0)


def test_a_link_model_without_the_method_fate_is_refused(short_plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "net.py").write_text(
        "class Net:\n    def __init__(self, seed): pass\n    def fate(self, seq): pass\n"
    )
    real = replace(as_planned(short_plan), link=laboratory_tables.RigTable("net.py:Net"), base=tmp_path)
    with pytest.raises(
        InputError, match=r"Net \(net.py\) named in \[link\] .* must have fate\(direction, seq, t\)"
    ):
        link_model(real)


def test_a_class_is_loaded_from_a_file_and_from_a_module(tmp_path: Path) -> None:
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
def test_a_class_that_cannot_be_loaded_gives_one_sentence(
    tmp_path: Path, reference: str, sentence: str
) -> None:
    (tmp_path / "lab.py").write_text("class Lab:\n    pass\n")
    (tmp_path / "broken.py").write_text("class Lab\n")
    with pytest.raises(InputError, match=sentence):
        find(reference, tmp_path, "[master.rig]")


def test_options_that_do_not_fit_the_class_give_one_sentence() -> None:
    with pytest.raises(InputError, match=r"Cannot construct Fake named in \[master.rig\].*colour"):
        construct(Fake, {"colour": 1}, "[master.rig]")
