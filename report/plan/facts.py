"""The figures of `rths check` as plain values, from what pre-flight computes."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path
from typing import Any

from common.lab.preflight import PreflightCheck
from common.plan.calibration import overdue
from common.plan.kinds import COLUMN, TABLE
from common.plan.plan import Plan
from common.roles import MASTER
from common.udp import probe
from common.udp.account import quantile
from common.udp.probe import Probed
from laboratories.kinds import kind_of
from loop import foreign, substructure
from loop.nominal import limited
from loop.nominal.partition import felt, matrices, taken_over
from loop.nominal.preflight import Findings, expected_delay, findings
from loop.rigs import probed, tried
from models.ground_motion import GroundMotion
from models.structures import shear_building
from recorder import space
from report.plan import classes, slips
from report.plan.named_test import of_test


def facts(plan: Plan, file: Path) -> dict[str, Any]:
    """What a plan describes; raises InputError where it cannot be used."""
    motion = substructure.motion(plan)
    built = foreign.checked(plan)  # first, because it fails at once where the model does
    tried(plan)
    found = findings(plan)
    rigs_there = [rig(one, plan) for one in probed(plan)]
    refusing = [one["risk"] for one in rigs_there if one["risk"]]
    made = [*found.checks, *built, space.check(plan, existing(Path(plan.recording.folder)))]
    return {
        **of_test(plan, file),
        "ground_motion": ground(plan, motion),
        "structure": structure(plan) | {"model": built[0].text if built else ""},
        "transfer_systems": transfer_systems(plan),
        "delay": delay(plan, found),
        "stable": not found.unstable,
        "peaks": peaks(plan, found),
        "recording": {"bytes": round(space.need(plan)), "folder": plan.recording.folder},
        "classes": [one._asdict() for one in classes.named(plan)],
        "rigs": rigs_there,
        "calibration": list(overdue(plan, date.today())),
        "slips": [one._asdict() for one in slips.slips(plan, motion, found)],
        "refused": [*(risk(one) for one in made if one.risk), *refusing],
        "ready": not refusing and not any(one.risk for one in made),
    }


def rig(probed: Probed, plan: Plan) -> dict[str, Any]:
    """A rig in another process: whether it is there, and how fast it answers."""
    found, refused = probed.found, probe.risk(probed, plan)
    ranked = sorted(found.round_trips_s)
    return {
        "where": probed.terms.where.strip("[]"),
        "address": probed.terms.address,
        "channels": f"{probed.channels:#010x}",
        "there": found.answer is not None,
        "exchanges": len(ranked) + found.lost,
        "lost": found.lost,
        "round_trip_p50": quantile(ranked, 0.5),
        "round_trip_p99": quantile(ranked, 0.99),
        "risk": refused._asdict() if refused else {},
    }


def risk(check: PreflightCheck) -> dict[str, str]:
    """A risk for which pre-flight would refuse."""
    return check.risk._asdict() if check.risk else {}


def existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    return next(one for one in (folder.absolute(), *folder.absolute().parents) if one.is_dir())


def finite(value: float) -> float | None:
    """A number as JSON can hold it."""
    return value if math.isfinite(value) else None


def ground(plan: Plan, motion: GroundMotion) -> dict[str, Any]:
    """The ground motion."""
    scale = plan.ground_motion.scale
    return {
        "text": motion.describe(),
        "scale": scale,
        "peak": abs(scale) * motion.peak,
        "duration": motion.duration,
    }


def structure(plan: Plan) -> dict[str, Any]:
    """Modes of the whole building, and the specimen's part in it."""
    modes = shear_building.modes(*matrices(plan))
    pairs = zip(modes.periods.tolist(), modes.damping_ratios.tolist(), strict=True)
    found: dict[str, Any] = {
        "storeys": plan.storeys,
        "modes": [mode(period, ratio) for period, ratio in pairs],
    }
    if plan.kinds.get(MASTER) == COLUMN:
        found["specimen"] = {
            "storey": plan.column.storey,
            "stiffness_felt": felt(plan).stiffness,
            "stiffness_left_to_it": taken_over(plan).stiffness,
        }
    return found


def mode(period: float, ratio: float) -> dict[str, Any]:
    """One mode; a rigid one has no period."""
    return {"period": finite(period), "frequency": 1.0 / period, "damping_ratio": finite(ratio)}


def transfer_systems(plan: Plan) -> dict[str, Any]:
    """What moves the specimens, and the dampers on their tables."""
    others = {role: system(plan, role) for role in plan.kinds if role != MASTER or plan.kinds[role] != COLUMN}
    if plan.kinds.get(MASTER) != COLUMN:
        return others
    actuator = plan.actuator
    first: dict[str, Any] = {
        "model": actuator.model,
        "delay": actuator.delay,
        "compensator": plan.compensator.kind,
    }
    if actuator.model == "servo_hydraulic":
        first["delay"] = actuator.servo.delay
    elif actuator.time_constant > 0.0:
        first["corner_frequency"] = 1.0 / (2.0 * math.pi * actuator.time_constant)
    return {"actuator": first} | others


def system(plan: Plan, role: str) -> dict[str, Any]:
    """A role's laboratory: a table with its damper, or the devices of another kind."""
    if plan.kinds[role] == TABLE:
        return table(plan.of(role))
    kind = kind_of(plan, role)
    return {"says": kind.says, "compensator": kind.compensator(plan.of(role)).kind}


def table(plan: Plan) -> dict[str, Any]:
    """One laboratory B."""
    damper, chosen = plan.damper, plan.table
    own = math.sqrt(damper.stiffness / damper.mass)
    return {
        "table_frequency": finite(chosen.frequency),
        "table_damping_ratio": chosen.damping_ratio,
        "table_delay": chosen.delay,
        "compensator": chosen.compensator.kind,
        "damper_frequency": own / (2.0 * math.pi),
        "damper_damping_ratio": damper.damping / (2.0 * damper.mass * own) if own > 0.0 else None,
        "damper_on": plan.control.amd,
    }


def delay(plan: Plan, found: Findings) -> dict[str, Any]:
    """The column's path: the expected delay (s), the critical delay (s), and the margin between them."""
    expected, critical = expected_delay(plan, found.partition), found.partition.critical_delay
    return {
        "frequency": found.partition.frequency,
        "expected": finite(expected),
        "critical": finite(critical),
        "margin": finite(critical / expected) if 0.0 < expected < math.inf else None,
        "margin_wanted": plan.preflight.delay_margin,
        "damping_lost": finite(found.partition.damping_points),
        "path_stable": found.partition.stable,
    }


def peaks(plan: Plan, found: Findings) -> dict[str, Any]:
    """Peaks of the simulated test and their limits; none of a loop that is unstable."""
    if found.unstable or found.peaks is None:
        return {}
    most = limited.most(plan)
    return {
        name: {
            "peak": peak,
            "limit": finite(most[name]),
            "share": peak / most[name],
            "unit": limited.unit_of(plan, name),
        }
        for name, peak in found.peaks.every.items()
    }
