"""The map of an import: which column is which signal, and the properties of the data logger's channels."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

from common import signals
from common.errors import InputError, PlanError
from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.schema import as_type, fill, key, nearest
from common.plan.toml_file import load_tables
from common.plan.units import converted
from common.recording.logger.low_pass import FILTERS, RIPPLING, LoggerFilter
from common.roles import MASTER, latency_topic, name_of
from common.signals import FieldType, Signal
from report.text.text_form import SPACES, StatedForm

Known = dict[str, tuple[str, Signal]]  # by our name of a signal its topic and its row there
GIVEN = (FieldType.NUMBER, FieldType.STOREYS, FieldType.INDEX)
STAMPS = ("command_one_way", "feedback_one_way", "round_trip")  # s, the times of a message that show the link


def lab_signals(plan: Plan) -> Known:
    """The signals that a map can name, with topic and row: those of a named slave are `NAME.signal`.

    They include the numbers and times of messages. A signal that master and slave share is the slave's. Where a slave
    without a name has a laboratory of the master's kind, its signals are `slave.signal`.
    """
    from laboratories import kinds

    found: Known = {}
    kind = kinds.own(plan)
    own = (kind.channels.target.name, *kind.channels.drives, *kind.channels.names) if kind else ()
    stamped = tuple(map(latency_topic, plan.roles))
    for topic, rows in kinds.topics(plan).items():
        for row in rows if topic in (MASTER, *plan.roles) else ():
            if row.kind in GIVEN and row is not signals.TIME:
                name = prefix(topic) + row.name
                found[f"{topic}.{name}" if topic != MASTER and name in own else name] = topic, row
        for row in rows if topic in stamped else ():
            if row.name in STAMPS:
                found[prefix(topic) + row.name] = topic, row
    return found


def prefix(topic: str) -> str:
    """Prefix of the signals of a topic: the name of its slave, if it has one."""
    return f"{name_of(topic)}." if name_of(topic) else ""


@dataclass(frozen=True)
class FilterTable:
    """The logger's low-pass filter."""

    type: str = key("kind of filter", choices=FILTERS)
    order: int = key("order", least=1, most=12)
    cutoff: float = key(
        "frequency at which 3 dB are lost; at which the ripple ends of a chebyshev or elliptic one",
        above=0.0,
        unit="Hz",
    )
    ripple: float = key(
        "of a chebyshev or elliptic one, in what it passes", default=0.5, above=0.0, most=3.0, unit="dB"
    )
    attenuation: float = key(
        "of an elliptic one, least of what it stops", default=60.0, least=20.0, unit="dB"
    )


@dataclass(frozen=True)
class SignalSource:
    """Where one of our signals comes from: ours = scale · theirs + offset, or a known value."""

    column: str = key("name of a column in the data", default="")
    scale: float = key("factor; −1 beside a unit, where the reading has the opposite sign", default=1.0)
    unit: str = key("unit of the column, instead of a factor", default="")
    delay: float = key("time by which the logger recorded it too late", default=0.0, unit="s")
    average: float = key(
        "time up to its row over which each reading is a mean", default=0.0, least=0.0, unit="s"
    )
    means: int = key(
        "number of such means that follow one another, 3 in a sinc³ filter", default=1, least=1, most=8
    )
    high_pass: float = key("corner of its amplifier's high-pass", default=0.0, least=0.0, unit="Hz")
    calibration: float = key("relative tolerance of its gain", default=0.0, least=0.0, most=1.0)
    offset: float = field(default=0.0, metadata=key("offset", default=0.0).metadata)
    resolution: float = field(default=0.0, metadata=key("step of the readings", default=0.0).metadata)
    filter: LoggerFilter | None = field(default=None, metadata=key("low-pass filter", default=0.0).metadata)
    value: float | None = field(default=None, metadata=key("known value", default=0.0).metadata)
    scaled: bool = field(
        default=False, metadata=key("whether scale or unit is given", default=False).metadata
    )
    delay_stated: bool = field(
        default=False, metadata=key("whether a delay is given", default=False).metadata
    )

    @property
    def late(self) -> bool:
        """Whether it is stated to come late, by a delay or as a mean over time."""
        return self.delay != 0.0 or self.average > 0.0


APART = ("value", "filter", "resolution", "offset")  # keys that need their own check
FORM = (
    "separator",
    "decimal",
    "thousands",
    "skip_rows",
)  # of a text file, recognised where they are left out
OUR_OWN = ("scaled", "delay_stated")  # fields that are set here and cannot be given as keys


@dataclass(frozen=True)
class ImportTable:
    """The keys of a map that hold for the whole file."""

    plan: str = key("file of the nominal models", default="")
    time: str = key("column of the time", default="")
    time_unit: str = key("unit of that column", default="")
    rate: float = key("samples per second, instead of a column of time", default=0.0, above=0.0, unit="Hz")
    start: float = key("time in the data from which on it is read", default=0.0, unit="s")
    stop: float = key("time in the data up to which it is read", default=0.0, unit="s")
    first_row: int = key("first row that is read, of a static test, counted from 1", default=0, least=1)
    last_row: int = key("last row that is read, of a static test", default=0, least=1)
    static: bool = key("each row is one tick, whatever its time", default=False)
    separator: str = key("character between columns", default="")
    decimal: str = key("decimal sign", default=".", choices=(".", ","))
    thousands: str = key("what parts groups of three digits", default="", choices=("'", " ", ",", "."))
    skip_rows: int = key("rows before that of the names", default=0, least=0)


@dataclass(frozen=True)
class ImportMap:
    """A map file: nominal models, and where our signals come from."""

    path: Path
    plan: Plan
    table: ImportTable
    signals: dict[str, SignalSource]
    form: StatedForm  # of a text file
    start: float | None  # s, in the data's own time
    stop: float | None

    @property
    def time(self) -> str:
        """The column of the time, empty where there is none."""
        return self.table.time

    @property
    def time_unit(self) -> str:
        """The unit of the time column, empty where the map does not give it."""
        return self.table.time_unit

    @property
    def rate(self) -> float:
        """Samples per second, 0 where a column holds the time."""
        return self.table.rate

    @property
    def span(self) -> slice:
        """The rows of a static test that are read."""
        return slice(max(self.table.first_row - 1, 0), self.table.last_row or None)

    @property
    def static(self) -> bool:
        """Whether each row is one tick, without regard to its time."""
        return self.table.static


def load_map(path: Path) -> ImportMap:
    """A map file; raises InputError naming what is wrong in it."""
    tables = load_tables(path, "map")
    rows = tables.pop("signals", None)
    for name in tables:
        if name not in ImportTable.__dataclass_fields__:
            hint = nearest(name, (*ImportTable.__dataclass_fields__, "signals"))
            raise InputError(f"Unknown key '{name}' in {path}: {hint}")
    if not tables.get("static") and ("time" in tables) == ("rate" in tables):
        raise InputError(
            f'{path}: give either time = "name of the time column" or rate = samples per second.'
        )
    if not isinstance(tables.get("plan"), str) or not isinstance(rows, dict) or not rows:
        raise InputError(f'{path}: give plan = "file.toml" and a table [signals].')
    try:
        table = fill(ImportTable, tables, "map")
    except PlanError as error:
        raise InputError(f"{path}: {str(error).replace(' in [map]', '')}") from None
    start, stop = (getattr(table, name) if name in tables else None for name in ("start", "stop"))
    form = StatedForm(**{name: tables[name] for name in FORM if name in tables})
    check(path, table, start, stop)
    check_form(path, form)
    plan = plans.load(path.parent / table.plan)
    known = lab_signals(plan)
    sources = {name: source(path, name, entry, known) for name, entry in rows.items()}
    for name in sources:
        check_single(path, plan, name, known)
    sought = (table.time, *(one.column for one in sources.values()))
    form = form._replace(columns=tuple(name for name in sought if name))
    return ImportMap(path, plan, table, sources, form, start, stop)


def check(path: Path, table: ImportTable, start: float | None, stop: float | None) -> None:
    """Raise InputError for keys that contradict each other."""
    if (start is not None or stop is not None) and not (table.time or table.rate):
        raise InputError(
            f'{path}: start and stop are times: give time = "name of the time column" too, or first_row and last_row '
            "of a static test."
        )
    if (table.first_row or table.last_row) and not table.static:
        raise InputError(f"{path}: first_row and last_row are for static = true: give start and stop, in s.")
    if start is not None and stop is not None and not stop > start:
        raise InputError(f"{path}: stop is {stop:g} s, but must be after start, which is {start:g} s.")


def check_form(path: Path, form: StatedForm) -> None:
    """Raise InputError for a form that no text has."""
    if form.separator is not None and len(form.separator) != 1:
        raise InputError(f"{path}: separator is {form.separator!r}, but must be one character.")
    pairs = [("separator", "decimal"), ("decimal", "thousands")]
    pairs += [("separator", "thousands")] * (
        form.separator == SPACES
    )  # another one may part both, in quoted cells
    for one, other in pairs:
        if getattr(form, one) is not None and getattr(form, one) == getattr(form, other):
            raise InputError(f"{path}: {one} and {other} are both {getattr(form, one)!r}: give each its own.")


def check_single(path: Path, plan: Plan, name: str, known: Known) -> None:
    """Raise InputError for a signal with one value per storey or slave in this plan."""
    _, row = known[name]
    per = "storey" if plan.storeys > 1 and row.kind is FieldType.STOREYS else ""
    per = "slave" if len(plan.roles) > 1 and row.slaves else per
    if per:
        raise InputError(
            f"{path}: '{name}' has one value per {per} in this plan, so one column cannot give it."
        )


def source(path: Path, name: str, entry: Any, known: Known) -> SignalSource:
    """One row of [signals]."""
    if name not in known:
        raise InputError(f"Unknown signal '{name}' in {path}: {nearest(name, known)}")
    where, (_, row) = f"signals.{name}", known[name]
    try:
        values = as_table(entry, where, '{ column = "name" }')
        apart = {word: values.pop(word) for word in APART if word in values}
        for word in OUR_OWN:
            if word in values:
                raise PlanError(f"Unknown key '{word}' in [{where}]: {nearest(word, APART)}")
        found = fill(SignalSource, values, where)
        if "unit" in values and "scale" in values and found.scale != -1.0:
            raise PlanError(
                f"'{name}' in [signals] has both a unit and a scale: give one of them, or scale = -1 beside the unit "
                "for a reading of the opposite sign."
            )
        if "means" in values and not found.average:
            raise PlanError(f"means of '{name}' in [signals] needs `average`, the time of one such mean.")
        scale = in_unit(found.unit, row, name) * found.scale if found.unit else found.scale
        step, low_pass = stated(apart, row, where)
        offset = as_type("float", apart.get("offset", 0.0), f"offset in [{where}]", row.unit)
    except (PlanError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
    value = apart.get("value")
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise InputError(f"{path}: value of '{name}' in [signals] must be a number, not {value!r}.")
    if (value is None) == (not found.column):
        raise InputError(f"{path}: '{name}' in [signals] must have either a column or a value.")
    return replace(
        found,
        scale=scale,
        offset=offset,
        resolution=step,
        filter=low_pass,
        value=None if value is None else float(value),
        scaled="unit" in values or "scale" in values,
        delay_stated="delay" in values,
    )


def as_table(given: Any, where: str, example: str) -> dict[str, Any]:
    """A copy of a table of the map; raises PlanError where there is something else."""
    if not isinstance(given, dict):
        raise PlanError(f"{where} is {given!r}, but must be a table such as {example}.")
    return dict(given)


def stated(apart: dict[str, Any], row: Signal, where: str) -> tuple[float, LoggerFilter | None]:
    """Resolution and filter of a signal; raises PlanError."""
    step = as_type("float", apart.get("resolution", 0.0), f"resolution in [{where}]", row.unit)
    if not step >= 0.0:
        raise PlanError(f"resolution in [{where}] is {step:g}, but must be at least 0 {row.unit}.")
    if "filter" not in apart:
        return step, None
    low_pass = as_table(
        apart["filter"], f"{where}.filter", '{ type = "butterworth", order = 4, cutoff = 100.0 }'
    )
    found = fill(FilterTable, low_pass, f"{where}.filter")
    of_kind = {"ripple": RIPPLING, "attenuation": RIPPLING[1:]}
    for name, kinds in of_kind.items():
        if name in low_pass and found.type not in kinds:
            raise PlanError(
                f"{name} in [{where}.filter] belongs to a filter of type {' or '.join(kinds)} only."
            )
    ripple, attenuation = (getattr(found, name) * (found.type in kinds) for name, kinds in of_kind.items())
    return step, LoggerFilter(found.type, found.order, found.cutoff, ripple, attenuation)


def in_unit(unit: str, row: Signal, name: str) -> float:
    """The factor from a unit to that of our signal; raises PlanError where it is one of another quantity."""
    return converted(Decimal(1), unit, row.unit, f"'{name}' in [signals]")
