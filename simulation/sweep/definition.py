"""The file of a sweep: which tests of a plan are computed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from common.errors import PlanError
from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.schema import fill, key, nearest, table_fields
from common.plan.toml_file import load_tables
from common.terminal import cli

MOST_ROWS = 10_000_000  # half a day of 16 processors; more is rather a slip in a count
LISTS = ("motion", "compensator", "parameters", "drawn")


@dataclass(frozen=True)
class SweepTable:
    """The keys at the head of the file."""

    plan: str = key("the plan: a file, or the name of one that ships", default="default")
    seed: int = key("seed of the draws and of the noise", default=1, least=0)
    draws: int = key("laboratories drawn for each combination", default=1, least=1, most=1_000_000)
    noise: bool = key("whether sensors have their noise", default=False)
    reality: str = key("reality or what a diagnosis found, a file; empty for the nominal models", default="")


@dataclass(frozen=True)
class IntensityTable:
    """`[intensity]`: the oscillator whose spectral acceleration is given beside the peak ground acceleration."""

    period: float = key("of the oscillator, 0 for none", default=0.0, unit="s", least=0.0)
    damping_ratio: float = key("of the oscillator", default=0.05, least=0.0, most=1.0)


@dataclass(frozen=True)
class MotionTable:
    """`[[motion]]`: a record and the factors on it; an empty record is the plan's."""

    record: str = key("a record that ships, or a file", default="")
    dt: float = key("interval of the samples, for files that do not say it", default=0.0, unit="s", least=0.0)
    unit: str = key("unit of the samples, for files that do not say it", default="")


@dataclass(frozen=True)
class DrawnTable:
    """An entry of `[drawn]`: a parameter of the plan that is drawn about its value."""

    dispersion: float = key(
        "lognormal: standard deviation of the logarithm; normal: coefficient of variation; uniform: half the width "
        "over the value",
        least=0.0,
        most=2.0,
    )
    distribution: str = key(
        "lognormal, normal or uniform", default="lognormal", choices=("lognormal", "normal", "uniform")
    )


@dataclass(frozen=True)
class SweptMotion:
    """A record as `[ground_motion]` of the plan names it, the folder from which its path starts, and the factors."""

    ground_motion: Mapping[str, Any]
    base: Path
    scales: tuple[float, ...]


@dataclass(frozen=True)
class SweptCompensator:
    """A compensator with its name in the table, and the keys of `[compensator]`; none for that of the plan."""

    name: str
    keys: Mapping[str, Any]


@dataclass(frozen=True)
class Sweep:
    """A sweep; rows are ordered by compensator, parameters, motion, scale and draw."""

    head: SweepTable
    intensity: IntensityTable
    plan: Plan
    motions: tuple[SweptMotion, ...]
    compensators: tuple[SweptCompensator, ...]
    parameters: Mapping[str, tuple[Any, ...]]  # values by the key of the plan, `table.key`
    drawn: Mapping[str, DrawnTable]
    base: Path  # from which the paths of the sweep start

    @cached_property
    def written(self) -> dict[str, Any]:
        """The tables of the plan, which are not to be changed."""
        return self.plan.written()

    @property
    def points(self) -> int:
        """The number of pairs of motion and scale."""
        return sum(len(one.scales) for one in self.motions)

    @property
    def combinations(self) -> int:
        """The number of combinations of the parameters."""
        return math.prod(map(len, self.parameters.values()))

    @property
    def rows(self) -> int:
        """The number of tests."""
        return len(self.compensators) * self.combinations * self.points * self.head.draws


def load(path: Path) -> Sweep:
    """The sweep in a TOML file.

    Raises:
        PlanError: the file or the plan cannot be read, or holds what no sweep or plan can.
    """
    tables = load_tables(path, "sweep")
    try:
        return from_tables(tables, path.parent)
    except PlanError as error:
        raise PlanError(f"The sweep {path}: {error}") from None


def from_tables(tables: Mapping[str, Any], base: Path) -> Sweep:
    """The sweep of nested plain values; paths start from `base`."""
    heads = [field.name for field in table_fields(SweepTable)]
    for name in tables:
        if name not in (*heads, *LISTS, "intensity"):
            raise PlanError(f"Unknown entry '{name}': {nearest(name, (*heads, *LISTS, 'intensity'))}")
    head = fill(SweepTable, {name: tables[name] for name in heads if name in tables}, "sweep")
    plan = plans.load(plan_path(head.plan, base))
    written = plan.written()
    drawn = {
        name: fill(DrawnTable, one, f"drawn.{name}")
        for name, one in entries(tables, "drawn", leaf="dispersion")
    }
    found = Sweep(
        head,
        fill(IntensityTable, tables.get("intensity", {}), "intensity"),
        plan,
        tuple(motion(one, plan, base) for one in listed(tables, "motion") or [{}]),
        tuple(compensator(one) for one in listed(tables, "compensator") or [{}]),
        {name: values_of(name, given, written) for name, given in entries(tables, "parameters")},
        {name: checked_draw(name, one, written) for name, one in drawn.items()},
        base,
    )
    check(found)
    return found


def plan_path(name: str, base: Path) -> Path:
    """The file of a plan that ships, by its name, or the path relative to `base`."""
    return cli.plan_path(name) if name in cli.SHIPPED and not (base / name).exists() else base / name


def check(sweep: Sweep) -> None:
    """Raise PlanError where a name occurs twice, or the sweep has too many rows."""
    names = [one.name for one in sweep.compensators]
    for name in names:
        if names.count(name) > 1:
            raise PlanError(f"Two [[compensator]] are called '{name}': give each a name of its own.")
    for name in sweep.drawn:
        if name in sweep.parameters:
            raise PlanError(f"'{name}' stands in [parameters] and in [drawn]: leave one of them out.")
    if sweep.head.draws > 1 and not (sweep.drawn or sweep.head.noise):
        raise PlanError(
            f"draws is {sweep.head.draws}, but nothing is drawn: give parameters in [drawn], or set noise to true."
        )
    if sweep.rows > MOST_ROWS:
        raise PlanError(f"It has {sweep.rows:,} tests, but may have at most {MOST_ROWS:,}: leave some out.")


def listed(tables: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    """The tables of an array `[[name]]`; raises PlanError where it is not an array of tables."""
    given = tables.get(name, [])
    if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
        raise PlanError(f"'{name}' must be tables [[{name}]], not {given!r}.")
    return given


def entries(tables: Mapping[str, Any], name: str, leaf: str = "") -> Iterator[tuple[str, Any]]:
    """The entries of a table by the keys of the plan, written `"table.key"` or `table.key`.

    With a `leaf`, entries are themselves tables, which have that key.
    """
    given = tables.get(name, {})
    if not isinstance(given, dict):
        raise PlanError(f"'{name}' must be a table [{name}], not {given!r}.")
    for first, value in given.items():
        if isinstance(value, dict) and leaf not in value:
            yield from ((f"{first}.{rest}", one) for rest, one in entries({first: value}, first, leaf))
        else:
            yield first, value


def motion(given: Mapping[str, Any], plan: Plan, base: Path) -> SweptMotion:
    """A `[[motion]]`; its record is the plan's where it gives none."""
    one = fill(MotionTable, {name: value for name, value in given.items() if name != "scales"}, "motion")
    own = plan.ground_motion
    factors = scales(given.get("scales", [own.scale]))
    if not one.record:
        return SweptMotion({"record": own.record, "dt": own.dt, "unit": own.unit}, plan.base, factors)
    return SweptMotion({"record": one.record, "dt": one.dt, "unit": one.unit}, base, factors)


def scales(given: object) -> tuple[float, ...]:
    """The factors on a motion: numbers, or a count of them from one to another at equal ratios.

    Raises:
        PlanError: they are neither, or not above 0.
    """
    if isinstance(given, dict):
        keys = {"from", "to", "count"}
        if set(given) != keys or not all(isinstance(value, int | float) for value in given.values()):
            raise PlanError(
                f"scales is {given!r}, but must be numbers, or {{ from = 0.1, to = 1.0, count = 10 }}."
            )
        first, last, count = float(given["from"]), float(given["to"]), given["count"]
        if not (0.0 < first < last < math.inf and isinstance(count, int) and 2 <= count <= MOST_ROWS):
            raise PlanError(
                f"scales is {given!r}, but from must be above 0 and below to, and count at least 2."
            )
        return tuple(first * (last / first) ** (place / (count - 1)) for place in range(count))
    found = given if isinstance(given, list) else [given]
    for one in found:
        if isinstance(one, bool) or not isinstance(one, int | float) or not 0.0 < one < math.inf:
            raise PlanError(f"scales holds {one!r}, but must hold numbers above 0.")
    if not found:
        raise PlanError("scales is empty: give at least one number.")
    return tuple(map(float, found))


def compensator(given: Mapping[str, Any]) -> SweptCompensator:
    """A `[[compensator]]`: the plan's own where it gives nothing but a name."""
    keys = {name: value for name, value in given.items() if name != "name"}
    name = given.get("name", keys.get("kind", "as planned"))
    if not isinstance(name, str) or not name:
        raise PlanError(f"name of a [[compensator]] is {name!r}, but must be text.")
    if keys and "kind" not in keys:
        raise PlanError(f"kind is missing in the [[compensator]] '{name}': give it.")
    return SweptCompensator(name, keys)


def values_of(name: str, given: object, written: Mapping[str, Any]) -> tuple[Any, ...]:
    """The values of a parameter; raises PlanError where the plan has no such key, or there are none."""
    value_at(name, written)
    if not isinstance(given, list) or not given:
        raise PlanError(f"'{name}' in [parameters] is {given!r}, but must be a list of values.")
    return tuple(given)


def checked_draw(name: str, drawn: DrawnTable, written: Mapping[str, Any]) -> DrawnTable:
    """The entry itself; raises PlanError where the plan has no such key, or nothing can be drawn about its value."""
    value = value_at(name, written)
    numbers = value if isinstance(value, list) else [value]
    if not all(isinstance(one, int | float) and not isinstance(one, bool) and one for one in numbers):
        raise PlanError(
            f"'{name}' in [drawn] is {value!r} in the plan: only a number other than 0 can be drawn about."
        )
    return drawn


def value_at(name: str, written: Mapping[str, Any]) -> Any:
    """The value of a key of the plan, `table.key`; raises PlanError where it has none."""
    found: Any = written
    for place, part in enumerate(parts := name.split(".")):
        if not isinstance(found, dict) or part not in found:
            above = ".".join([*parts[:place], ""])
            known = [above + one for one in found] if isinstance(found, dict) else []
            raise PlanError(f"The plan has no key '{name}': {nearest(above + part, known)}")
        found = found[part]
    if isinstance(found, dict):
        raise PlanError(f"'{name}' is a table of the plan: name one of its keys ({', '.join(found)}).")
    return found


def changed(written: dict[str, Any], name: str, value: Any) -> None:
    """Give a key of nested plain values, `table.key`, another value; the tables on the way are copied."""
    *tables, last = name.split(".")
    here = written
    for part in tables:
        here[part] = dict(here[part])
        here = here[part]
    here[last] = value


def described(sweep: Sweep) -> str:
    """A short text on what is multiplied."""
    counts: Sequence[tuple[int, str]] = (
        (len(sweep.compensators), "compensator"),
        (sweep.combinations, "combination of parameters"),
        (len(sweep.motions), "motion"),
        (sweep.points, "pair of motion and scale"),
        (sweep.head.draws, "draw"),
    )
    return ", ".join(f"{count:,} {plural(count, word)}" for count, word in counts)


def plural(count: int, word: str) -> str:
    """A count with its noun in singular or plural."""
    head, _, rest = word.partition(" ")
    return word if count == 1 else f"{head}s {rest}".rstrip()
