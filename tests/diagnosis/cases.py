"""Recordings of laboratories whose hidden effects are known, each made once per session in virtual time."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InterlockError, RthsError
from common.plan import read as plans
from common.plan.plan import Plan
from common.reality import reality
from common.recording.imported import IMPORT
from common.recording.reader import read
from common.terminal import cli
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.search import Search
from diagnosis.recorded import record
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from laboratories.effects import CATALOGUE
from models.registry import Array
from rths.examine.diagnose import diagnose_file
from simulation import virtual

SECONDS = 10.0
STRONGEST = 4.0  # s, from the beginning: the strongest motion lies in them
JITTERED = (  # nominal parameters that no laboratory meets exactly
    ("actuator", "delay"),
    ("actuator", "time_constant"),
    ("column", "stiffness"),
    ("table", "frequency"),
    ("table", "damping_ratio"),
    ("damper", "stiffness"),
    ("damper", "damping"),
    ("damper", "mass"),
)
TOLERANCE = 0.02
UNKNOWN_TO_A_LOGGER = ("damper_force_used", "column_target", "table_target")

Effects = Mapping[str, Mapping[str, float]]


def short(duration: float = SECONDS, **test: Any) -> Plan:
    """The default plan, shorter."""
    return plans.with_test(plans.load(cli.plan_path(None)), duration=duration, **test)


def jitter(seed: int) -> dict[str, float]:
    """The error of each nominal parameter, in tolerances."""
    draws = np.random.default_rng(seed).normal(0.0, 0.7, len(JITTERED)).clip(-1.5, 1.5)
    return {f"{table}.{field}": float(draw) for (table, field), draw in zip(JITTERED, draws, strict=True)}


def tables(base: Plan, effects: Effects, off: Mapping[str, float], seed: int) -> dict[str, Any]:
    """A reality as the tables of its file."""
    result: dict[str, Any] = {"seed": seed}
    for name, z in off.items():
        table, field = name.split(".")
        value = np.asarray(getattr(getattr(base, table), field)) * (1.0 + TOLERANCE * z)
        result.setdefault(table, {})[field] = value.tolist()
    result["effect"] = [{"name": name, **values} for name, values in effects.items()]
    return result


def play(base: Plan, given: Mapping[str, Any], path: Path) -> RthsError | None:
    """Record the test of a plan in the laboratories of the reality `given`; returns the error that ended it."""
    true = reality.from_reality(dict(given), base, Path())
    return virtual.run(virtual.assemble(base, true, path), lambda: "")


def lab_a(whole: Record) -> LaboratoryPart:
    """The master's laboratory of a record as a part."""
    assert whole.own is not None
    return LaboratoryPart(whole, whole.own)


def lab_b(whole: Record) -> LaboratoryPart:
    """The slave's laboratory of a record as a part."""
    assert whole.other is not None
    return LaboratoryPart(whole, whole.other)


def imported(whole: Record, change: Callable[[Array], Array] = lambda x: x, unit: str = "") -> Record:
    """The record as an import of what a logger made of every reading, or of those in a unit.

    It holds no targets and no force used.
    """
    read = {name for lab in whole.labs for name in lab.measured if unit in ("", whole.unit(name))}
    signals = {
        name: change(values) if name in read else values
        for name, values in whole.signals.items()
        if name not in UNKNOWN_TO_A_LOGGER
    }
    metadata = whole.run.metadata | {IMPORT: {"data": "measurements.csv"}}
    return replace(whole, signals=signals, run=replace(whole.run, metadata=metadata))


def unknown(fit: Fit) -> PartVerdict:
    """The verdict that nothing explains what a fit leaves."""
    return PartVerdict(Search(fit.data, fit, fit, ()), "unknown", 1.0, (), ())


class Cases:
    """Recordings and reports, each made at its first request, by any of the workers that share a run's tests.

    A recording that is asked for without a duration takes `seconds` s.
    """

    def __init__(self, factory: pytest.TempPathFactory, seconds: float = SECONDS) -> None:
        self.seconds = seconds
        base = factory.getbasetemp()
        self.folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "cases"
        self.folder.mkdir(exist_ok=True)

    def file(
        self, effects: Effects | None = None, seed: int = 1, duration: float | None = None, scale: float = 0.1
    ) -> Path:
        """The recording of a case; `seed` draws the noise and the errors of the nominal parameters (0: no errors)."""
        chosen, seconds = effects or {}, duration or self.seconds
        key = repr((chosen, seed, seconds, scale))
        path = self.folder / f"{hashlib.sha256(key.encode()).hexdigest()[:16]}.mcap"
        if not path.exists():
            begun, base = path.with_suffix(f".{os.getpid()}.mcap"), short(seconds, scale=scale)
            error = play(base, tables(base, chosen, jitter(seed) if seed else {}, seed), begun)
            assert error is None or isinstance(error, InterlockError)
            begun.replace(path)
        return path

    def record(self, effects: Effects | None = None, **options: Any) -> Record:
        """The recording laid out."""
        return record.build(read(self.file(effects, **options)))

    def report(self, effects: Effects | None = None, **options: Any) -> dict[str, Any]:
        """The diagnosis of a case."""
        recording = self.file(effects, **options)
        path = recording.with_suffix(".json")
        if not path.exists():
            begun = path.with_suffix(f".{os.getpid()}.json")
            begun.write_text(json.dumps(diagnose_file(recording).plain()), encoding="utf-8")
            begun.replace(path)
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return found


def named(report: Mapping[str, Any]) -> list[str]:
    """The effects of a verdict."""
    return sorted(report["which"][0]["effects"])


def counts_as(report: Mapping[str, Any], effect: str) -> bool:
    """Whether a verdict names an effect, or one that these signals cannot tell from it."""
    sets = [set(names) for names in report["equivalent"]]
    return any(name == effect or any({name, effect} <= names for names in sets) for name in named(report))


def estimate(report: Mapping[str, Any], effect: str, parameter: str) -> float:
    """The estimate of a parameter in a verdict."""
    return float(report["which"][0]["parameters"][effect][parameter]["value"])


def away(effect: str, parameter: str, value: float) -> float:
    """The distance of a parameter from the value at which its effect vanishes."""
    null = next(item.null for item in CATALOGUE[effect].parameters if item.name == parameter)
    return value - null if np.isfinite(null) else value


def white(seed: int, *shape: int) -> Array:
    """White noise of rms one."""
    return np.random.default_rng(seed).standard_normal(shape)


def moved_by(whole: Record, more: Array) -> Record:
    """The record of a slave whose table makes `more` motion (ticks,) in m than its command says."""
    part = lab_b(whole)
    command = next(iter(part.inputs))
    change = part.replaced(inputs=part.inputs | {command: part.inputs[command] + more})
    system = residuals.prepare(part, whole).system
    shown = dict(zip(part.signals, (change.predict(system) - part.predict(system)).T, strict=True))
    return replace(
        whole, signals=whole.signals | {name: whole.signals[name] + x for name, x in shown.items()}
    )
