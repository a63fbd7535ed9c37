"""The generated parts of the documents: `python -m docs.generate` writes them, and the schema of reports.

A part stands between `<!-- name -->` and `<!-- end of name -->`; tests/test_docs.py holds that it is up to date.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from common.plan import patience
from common.plan.plan import Plan
from common.plan.read import parse
from common.plan.tables import Limits, Preflight, SafetyTable
from common.rig import ColumnMeasurement, TableCommand, TableMeasurement
from common.roles import MASTER
from common.safety.modes import MEANING, TURNS, Mode, mermaid
from common.signals import CLIENT, OF_STOREYS, SENT, TOPICS
from common.udp import packets
from diagnosis.report import schema
from docs import effect_equations, reference_tables, tried
from docs.markdown import quantity, table

EVERY_KIND = '[slave.a]\nkind = "table"\n[slave.b]\nkind = "column"\n'  # at slaves

FOLDER = Path(__file__).resolve().parent

# Limits on quantities that are not fields of a command or a measurement.
MASTER_DERIVED = (
    "actuator_velocity",
    "actuator_acceleration",
    "actuator_step",
    "column_error",
    "numerical_drift",
    "error_energy",
)
SLAVE_DERIVED = ("table_velocity", "table_step", "table_error", "damper_step")

CHECKED_BY = {
    "A": frozenset({*ColumnMeasurement._fields, "actuator_command", *SENT, *OF_STOREYS, *MASTER_DERIVED}),
    "B": frozenset({*TableMeasurement._fields, *SENT, *TableCommand._fields, *SLAVE_DERIVED}),
}


def parts() -> dict[str, dict[str, str]]:
    """The text of every part, by document and name."""
    return {
        "explanation/safety.md": {
            "modes": f"```mermaid\n{mermaid()}\n```\n",
            "turns": turns(),
            "patience": patient(parse(EVERY_KIND, Path())),
            "watchdog and ramp": keys(SafetyTable),
            "motion": motion(Plan()),
            "limits": limits(),
            "pre-flight": keys(Preflight),
        },
        "decisions.md": {"decisions": decisions()},
        "reference/plan.md": {"keys": reference_tables.plan()},
        "reference/udp-rig.md": {
            "request": reference_tables.packet(packets.REQUEST),
            "modes of a laboratory": reference_tables.numbered(mode.value for mode in Mode),
            "answer": reference_tables.packet(packets.ANSWER),
            "states of a rig": reference_tables.numbered(packets.STATES.values()),
            "channels of kinds": reference_tables.channels(),
        },
        "reference/tried.md": {"locked": tried.locked()},
        "reference/signals.md": {"topics": topics()},
        "reference/commands.md": {"commands": reference_tables.commands()},
        "reference/effects.md": {"effects": reference_tables.effects()},
        "reference/effect-equations.md": {"equations": effect_equations.equations()},
        "reference/compensators.md": {"compensators": reference_tables.compensators()},
        "reference/models.md": {
            "specimens": reference_tables.specimens(),
            "integrators": reference_tables.integrators(),
            "motions": reference_tables.motions(),
        },
        "reference/exit-codes.md": {"exits": reference_tables.exits()},
        "reference/diagnosis-report.md": {"records": reference_tables.report()},
        "reference/budget.md": {"budget": reference_tables.budget()},
        "reference/rooms.md": {"rooms": reference_tables.rooms()},
    }


def turns() -> str:
    """What each turn of the state machine means, and where it leads from and to."""
    rows = []
    for turn, meaning in MEANING.items():
        ways = [f"{mode.value} → {row[turn].value}" for mode, row in TURNS.items() if turn in row]
        rows.append((f"`{turn.value}`", meaning, ", ".join(ways)))
    return table(("turn", "happens when", "from → to"), rows)


def keys(cls: type[Any]) -> str:
    """The keys of a table of the plan."""
    fields = ((field, field.metadata["rule"]) for field in dataclasses.fields(cls))
    rows = ((f"`{field.name}`", quantity(field.default), rule.unit, rule.text) for field, rule in fields)
    return table(("key", "default", "unit", "meaning"), rows)


def patient(plan: Plan) -> str:
    """The figures that are larger where all laboratories are emulated."""
    rows = (
        (f"`[{name.partition('.')[0]}] {name.partition('.')[2]}`", *map(quantity, pair))
        for name in plan.eased
        for pair in [(patience.standard(name), patience.figure(plan, name))]
    )
    return table(("figure", "beside a rig", "emulated, at an interval of 2 ms"), rows)


def limits() -> str:
    """The limits, and the laboratories that check them."""
    rows = []
    for field in dataclasses.fields(Limits):
        rule = field.metadata["rule"]
        labs = " and ".join(lab for lab, names in CHECKED_BY.items() if field.name in names)
        rows.append((f"`{field.name}`", quantity(field.default), rule.unit, rule.text, labs))
    return table(("key", "default", "unit", "on", "checked by"), rows)


def motion(plan: Plan) -> str:
    """The most that a displacement command goes on after the last fresh message, at the speed its limit allows."""
    safety, rows = plan.safety, []
    for title, speed in (
        ("actuator", plan.limits.actuator_velocity),
        ("table", plan.limits.table_velocity),
    ):
        ways = (
            speed * safety.ramp_after * plan.test.interval,
            speed**2 / (2.0 * safety.acceleration),
            speed * safety.acceleration / (2.0 * safety.jerk),
        )
        figures = (f"{way * 1e3:.2f} mm" for way in (*ways, sum(ways)))
        rows.append((title, f"{speed:g} m/s", *figures))
    return table(("", "v_lim", "v_lim·W2", "v_lim²/(2·a)", "v_lim·a/(2·j)", "together"), rows)


def topics() -> str:
    """Every topic with its signals."""
    texts = []
    served = {f"{MASTER}` of `rths serve`, in place of the building's": CLIENT}
    for topic, signals in (TOPICS | served).items():
        rows = ((f"`{signal.name}`", signal.unit, signal.text) for signal in signals)
        texts.append(f"## `{topic}{'`' * (topic in TOPICS)}\n\n{table(('signal', 'unit', 'meaning'), rows)}")
    return "\n".join(texts)


def decisions() -> str:
    """The records of decisions, by what each decides."""
    titles = {path: path.read_text(encoding="utf-8").partition("\n")[0] for path in records()}
    return "".join(f"- [{title.lstrip('# ')}](decisions/{path.name})\n" for path, title in titles.items())


def records() -> list[Path]:
    """The files of the records, in order."""
    return sorted((FOLDER / "decisions").glob("[0-9]*.md"))


def renewed(text: str, named: dict[str, str]) -> str:
    """A document with its parts as they are now; raises ValueError where one has no place in it."""
    for name, part in named.items():
        before, begin, rest = text.partition(f"<!-- {name} -->\n")
        _, end, after = rest.partition(f"<!-- end of {name} -->\n")
        if not begin or not end:
            raise ValueError(f"The document has no place for '{name}'.")
        text = f"{before}{begin}\n{part}\n{end}{after}"
    return text


def main() -> None:
    """Write the parts into the documents, and the schema."""
    schema.PUBLISHED.write_text(schema.text(), encoding="utf-8")
    for name, named in parts().items():
        path = FOLDER / name
        path.write_text(renewed(path.read_text(encoding="utf-8"), named), encoding="utf-8")


if __name__ == "__main__":
    main()
