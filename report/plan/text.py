"""The figures of `rths check` for a reader."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from report.text.formats import quantity
from report.text.terminal import table

BAR = 20  # characters for a peak at its limit


def show(facts: Mapping[str, Any]) -> None:
    """Write what a plan describes."""
    write = sys.stdout.write
    write("\n".join(described(facts)) + "\n\n")
    if facts["peaks"]:
        rows = [["peaks expected", "peak", "limit", "", ""]]
        rows += [peak_row(name, one) for name, one in facts["peaks"].items()]
        table([[row[0], *row[1:4], row[4].ljust(BAR)] for row in rows])
        write("\n")
    elif facts["structure"]:
        write("The simulated loop is unstable, so that it has no peaks to compare with limits.\n\n")
    for line in concerns(facts):
        write(f"{line}\n")


def described(facts: Mapping[str, Any]) -> Iterator[str]:
    """Lines on the test, the building or else the machine, the transfer systems, the delay and the recording."""
    first, *others = named(facts)
    yield f"{first[0]}: {first[1]}"
    for name, text in others:
        yield f"{name:<17} {text}"


def named(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """The same as pairs of a name and a text; the first name is the plan's file."""
    yield (
        facts["plan"],
        f"test '{facts['test']}', {facts['duration']:g} s in {facts['ticks']} intervals of "
        f"{facts['interval'] * 1e3:g} ms",
    )
    if not facts["structure"]:
        for name, values in facts["machine"].items():
            yield name, ", ".join(value_text(key, one) for key, one in values.items())
        return
    ground = facts["ground_motion"]
    yield "ground motion", f"{ground['text']}; × {ground['scale']:g}: peak {ground['peak']:.3g} m/s²"
    if facts["structure"]["model"]:
        yield "building", f"{facts['structure']['model']}; the modes are those of [structure]"
    for number, mode in enumerate(facts["structure"]["modes"], start=1):
        yield f"mode {number}", mode_text(mode)
    if specimen := facts["structure"].get("specimen"):
        yield (
            "specimen",
            f"storey {specimen['storey']}, felt as {specimen['stiffness_felt']:.4g} N/m; the "
            f"building leaves {specimen['stiffness_left_to_it']:.4g} N/m to it",
        )
    for role, system in facts["transfer_systems"].items():
        yield role, system_text(role, system)
    for rig in facts["rigs"]:
        yield rig["where"], rig_text(rig)
    yield "delay", delay_text(facts["delay"])
    yield "recording", f"about {facts['recording']['bytes'] / 1e6:.1f} MB in {facts['recording']['folder']}"


def value_text(name: str, one: Mapping[str, Any]) -> str:
    """A value that a plan states, with its unit."""
    value = f"{one['value']:g}" if isinstance(one["value"], float) else str(one["value"])
    return f"{name} {value} {one['unit']}".rstrip()


def mode_text(mode: Mapping[str, Any]) -> str:
    """One mode of the building."""
    if mode["period"] is None:
        return "rigid"
    return (
        f"{mode['period']:.4g} s ({mode['frequency']:.3f} Hz), damping {mode['damping_ratio'] * 100.0:.2f} %"
    )


def system_text(role: str, system: Mapping[str, Any]) -> str:
    """The actuator, a table, or a laboratory of another kind."""
    if "says" in system:
        return f"{system['says']}, compensator {system['compensator']}"
    return actuator_text(system) if role == "actuator" else table_text(system)


def actuator_text(system: Mapping[str, Any]) -> str:
    """The actuator of laboratory A."""
    corner = f"lag of {system['corner_frequency']:.2f} Hz, " if "corner_frequency" in system else ""
    model = "servo-hydraulic, " if system["model"] == "servo_hydraulic" else ""
    return f"{model}{corner}dead time {system['delay'] * 1e3:.1f} ms, compensator {system['compensator']}"


def table_text(system: Mapping[str, Any]) -> str:
    """The table of a laboratory B and its damper."""
    frequency = system["table_frequency"]
    speed = f"{frequency:.2f} Hz" if frequency else "ideal"
    ratio = system["damper_damping_ratio"]
    damped = f", damping {ratio * 100.0:.1f} %" if ratio is not None else ""
    state = "" if system["damper_on"] else ", off"
    return (
        f"table {speed}, dead time {system['table_delay'] * 1e3:.1f} ms, compensator {system['compensator']}; "
        f"damper {system['damper_frequency']:.3f} Hz{damped}{state}"
    )


def rig_text(rig: Mapping[str, Any]) -> str:
    """A rig in another process."""
    text = f"{rig['address']}, channels {rig['channels']}"
    if not rig["there"]:
        return f"{text}: nothing answers"
    return (
        f"{text}: {rig['exchanges'] - rig['lost']} of {rig['exchanges']} exchanges, round trip p50 "
        f"{rig['round_trip_p50'] * 1e3:.3f} ms, p99 {rig['round_trip_p99'] * 1e3:.3f} ms"
    )


def delay_text(delay: Mapping[str, Any]) -> str:
    """The column's path."""
    critical = (
        f"critical {delay['critical'] * 1e3:.1f} ms"
        if delay["critical"] is not None
        else "stable at any delay"
    )
    if not delay["path_stable"]:
        return f"{critical}; unstable: the actuator does not come to rest under its compensator"
    text = f"expected {delay['expected'] * 1e3:.1f} ms at {delay['frequency']:.2f} Hz, {critical}"
    if delay["margin"] is None:
        return text
    margin = f", margin {delay['margin']:.1f} of {delay['margin_wanted']:g} wanted"
    return f"{text}{margin}{'; unstable' if delay['margin'] <= 1.0 else ''}"


def peak_row(name: str, peak: Mapping[str, Any]) -> list[str]:
    """A peak beside its limit, with a bar; the bar ends in an arrow where the limit is passed."""
    share, unit = peak["share"], peak["unit"]
    bar = "█" * round(BAR * min(share, 1.0)) + ("▶" if share > 1.0 else "")
    limit = quantity(peak["limit"], unit) if peak["limit"] is not None else "none"
    return [name, quantity(peak["peak"], unit), limit, f"{share:.0%}", bar]


def code(classes: Sequence[Mapping[str, str]], *, emulated: bool = True) -> Iterator[str]:
    """The classes that a plan names, each in a sentence; `emulated` where it has no rig of the user's."""
    for one in classes:
        place = one["file"] or "a file that is not there"
        what = "model" if one["where"] == "structure" or ":" not in one["name"] else "class"
        yield (
            f"[{one['where']}] runs the {what} '{one['name']}' from {place}, with your rights: only run plans that "
            "you trust."
        )
    if not classes:
        others = "all laboratories are emulated" if emulated else "its rigs are in other processes"
        yield f"The plan names no class of its own: {others}."


def concerns(facts: Mapping[str, Any]) -> Iterator[str]:
    """What to look at before the test: classes, slips, refusals."""
    yield from code(facts["classes"], emulated=not facts["rigs"])
    for slip in facts["slips"]:
        yield f"a slip of units? {slip['where']}: {slip['text']}"
    for text in facts["calibration"]:
        yield f"{text[0].upper()}{text[1:]}: calibrate the sensor, or correct the date in the plan."
    for risk in facts["refused"]:
        yield f"pre-flight would refuse ({risk['name']}): {risk['sentence']}."
    if not facts["structure"]:
        yield (
            "The plan is of a machine by itself, as it states no [structure] and no [ground_motion]: a test of it "
            "would have those of the default test, which --building describes."
        )
    elif facts["ready"]:
        yield "Pre-flight would let this test begin, as far as it can be judged without the laboratories."
