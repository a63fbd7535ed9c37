"""The tables of a plan but those of its laboratories: their keys, defaults and allowed ranges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from common.plan.schema import NAME, Storeys, StoreysOrMatrix, inner, key

LONGEST_TEST = 7200.0  # s


@dataclass(frozen=True)
class Test:
    """What the test is called, how long it lasts and its control interval."""

    __test__ = False  # not a test case of pytest

    name: str = key("name of the test, part of topics and file names", default="default", pattern=NAME)
    duration: float = key("length of the test", default=40.0, unit="s", above=0.0, most=LONGEST_TEST)
    interval: float = key("control interval", default=0.002, unit="s", least=1e-4, most=0.1)
    seed: int = key("seed of every random draw", default=1, least=0)


@dataclass(frozen=True)
class GroundMotionTable:
    """The earthquake."""

    record: str = key(
        "name of a shipped record, or path of a file: AT2, K-NET or columns of text",
        default="el_centro_1940_ns",
    )
    scale: float = key("factor on the record", default=0.1)
    dt: float = key(
        "time between samples of a file of one column; 0: the file says it", default=0.0, unit="s", least=0.0
    )
    unit: str = key(
        "acceleration of a file of columns whose header names no unit; empty: m/s2",
        default="",
        choices=("", "g", "gal", "cm/s2", "m/s2", "mm/s2"),
    )


@dataclass(frozen=True)
class NumericalColumnsTable:
    """Force-deformation model of the numerical columns of every storey."""

    model: str = key("name of a specimen model", default="linear")
    parameters: dict[str, float] = key("parameters of that model beside the stiffness", default={}, more=True)


@dataclass(frozen=True, kw_only=True)
class Experimental:
    """What the specimen takes over of the whole building, left out of the numerical part.

    Stiffness and damping act on the drift of the specimen's storey, the mass on the floor above it. Without this table
    the specimen takes over its share of the storey's columns, `represents` of `columns_per_storey`; with it the
    stiffness must be given.
    """

    mass: float = key("of the floor above the specimen's storey", default=0.0, unit="kg", least=0.0)
    stiffness: float = key("of the specimen's storey", unit="N/m", least=0.0)
    damping: float = key("of the specimen's storey", default=0.0, unit="N·s/m", least=0.0)


OF_PLAN, OF_CLIENT = "plan", "client"  # whose model the building is
OPENSEES, FMU = "opensees:", ".fmu"  # beginning and end of a model that a program beside the master computes


@dataclass(frozen=True)
class Structure:
    """The building: one value per storey, or one for a single storey."""

    mass: Storeys = key("floor masses, from the bottom", default=(160_000.0,), unit="kg", above=0.0)
    stiffness: StoreysOrMatrix = key(
        "storey stiffnesses, all columns; or the whole building's symmetric matrix as a list of rows",
        default=(25e6,),
        unit="N/m",
        least=0.0,
    )
    damping: Storeys = key("storey dashpots", default=(200_000.0,), unit="N·s/m", least=0.0)
    damping_ratio: float = key(
        "damping ratio of every mode of the whole building in place of the dashpots, 0 for the dashpots",
        default=0.0,
        least=0.0,
        most=1.0,
    )
    integrator: str = key("integration method", default="newmark_explicit")
    rho_infinity: float = key("KR-α: spectral radius at infinity", default=0.5, least=0.0, most=1.0)
    model: str = key(
        "what computes the building: plan, from these tables; opensees:FILE.py, a model of OpenSees, or FILE.fmu, "
        "whose code the test then runs; or client, the program that rths serve answers",
        default=OF_PLAN,
    )
    options: dict[str, Any] = key(
        "opensees: keyword arguments of build; FMU: inputs, outputs, start", default={}
    )
    intervals: int = key(
        "client: control intervals in which each of its displacements is imposed",
        default=1,
        least=1,
        most=100_000,
    )
    columns: NumericalColumnsTable = inner(NumericalColumnsTable)
    experimental: Experimental | None = field(default=None, metadata={"table": Experimental, "more": False})


@dataclass(frozen=True)
class SensorsTable:
    """White noise of each reading, rms."""

    column_displacement: float = key("specimen deformation", default=5e-6, unit="m", least=0.0)
    column_force: float = key("specimen force", default=100.0, unit="N", least=0.0)
    table_displacement: float = key("table displacement", default=10e-6, unit="m", least=0.0)
    table_acceleration: float = key("table acceleration", default=0.01, unit="m/s²", least=0.0)
    damper_stroke: float = key("damper stroke", default=2e-6, unit="m", least=0.0)
    damper_force: float = key("damper force", default=0.2, unit="N", least=0.0)


@dataclass(frozen=True)
class Security:
    """Certificates of the link; without a folder it is open, which is for loopback and networks one trusts."""

    folder: str = key("folder of the certificates that `rths keys` makes, empty for an open link", default="")


@dataclass(frozen=True)
class Link:
    """The exchange between the laboratories."""

    connect_timeout: float = key(
        "wait for the other laboratory", default=30.0, unit="s", above=0.0, most=3600.0
    )
    loss_timeout: float = key(
        "silence after which a laboratory is lost", default=1.0, unit="s", above=0.0, most=60.0
    )
    wait_share: float = key(
        "share of the interval a message is waited for", default=0.75, above=0.0, most=0.95
    )
    security: Security = inner(Security)


@dataclass(frozen=True)
class SafetyTable:
    """What a laboratory does on its own when fresh messages stay away, and how it comes to rest."""

    hold_after: int = key(
        "intervals without a fresh message after which a laboratory holds", default=3, least=1, most=100_000
    )
    ramp_after: int = key(
        "intervals without a fresh message after which it ramps to its safe state",
        default=5,
        least=2,
        most=100_000,
    )
    overrun: int = key(
        "intervals by which a laboratory's own loop may be late before it ramps to its safe state",
        default=5,
        least=1,
        most=100_000,
    )
    frozen_readings: int = key(
        "readings in a row, the same to the last bit while the rig's command moves, by which a sensor is frozen",
        default=25,
        least=2,
        most=100_000,
    )
    message_age: float = key(
        "age beyond which a message is not fresh, by its number", default=0.1, unit="s", above=0.0
    )
    velocity: float = key("speed at which the specimen is unloaded", default=0.01, unit="m/s", above=0.0)
    acceleration: float = key("largest acceleration of the ramp", default=10.0, unit="m/s²", above=0.0)
    jerk: float = key("largest jerk of the ramp", default=2000.0, unit="m/s³", above=0.0)
    release: float = key(
        "time in which the damper's force is taken to zero", default=0.02, unit="s", above=0.0, most=10.0
    )
    settle: float = key(
        "time at rest before the rig is disarmed, for the transfer system to follow",
        default=0.1,
        unit="s",
        least=0.0,
        most=60.0,
    )
    unload: bool = key("whether the specimen is unloaded once it has come to a hold", default=True)
    wait_for_reset: bool = key(
        "whether a laboratory that came to its safe state stays there until `rths reset`", default=False
    )


@dataclass(frozen=True)
class Preflight:
    """What must hold before a laboratory arms."""

    disk_factor: float = key("free disk over the recording's expected size", default=2.0, least=0.0)
    exchanges: int = key("exchanges that the link must pass", default=1000, least=10, most=1_000_000)
    lost: int = key("exchanges of them that may be lost", default=0, least=0)
    late_share: float = key(
        "share of them that may take longer than the interval", default=0.05, least=0.0, most=1.0
    )
    delay_margin: float = key(
        "critical delay of the partition over the delay to expect", default=1.5, least=0.0
    )
    peak_share: float = key("simulated peak over the limit", default=0.9, above=0.0)
    readings: int = key("readings by which the sensors are judged", default=50, least=2, most=100_000)


def limit(text: str, default: float, unit: str = "", *, infinite: bool = False) -> Any:
    """Field of a limit, which is above 0, and inf for none where it may be `infinite`."""
    return key(text, default=default, unit=unit, above=0.0, infinite=infinite)


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes; beyond one of them the test is stopped."""

    displacement: float = limit("storey displacement", 0.15, "m")
    velocity: float = limit("storey velocity", 1.0, "m/s", infinite=True)
    acceleration: float = limit("storey acceleration", 30.0, "m/s²", infinite=True)
    actuator_command: float = limit("actuator command", 0.05, "m")
    actuator_velocity: float = limit("speed of the actuator command", 0.5, "m/s", infinite=True)
    actuator_acceleration: float = limit(
        "acceleration of the actuator command, its noise included", 500.0, "m/s²", infinite=True
    )
    actuator_step: float = limit(
        "change of the actuator command within one interval", 0.005, "m", infinite=True
    )
    column_displacement: float = limit("specimen deformation", 0.03, "m")
    column_error: float = limit(
        "specimen deformation beside its target, for three intervals", 0.01, "m", infinite=True
    )
    column_force: float = limit("specimen force", 400e3, "N")
    table_target: float = limit("table target", 0.40, "m")
    table_target_velocity: float = limit("velocity of the table target", 1.5, "m/s", infinite=True)
    table_target_acceleration: float = limit("acceleration of the table target", 30.0, "m/s²", infinite=True)
    table_command: float = limit("table command", 0.40, "m")
    table_velocity: float = limit("speed of the table command", 1.5, "m/s", infinite=True)
    table_step: float = limit("change of the table command within one interval", 0.01, "m", infinite=True)
    table_error: float = limit(
        "table displacement beside its target, for three intervals", 0.02, "m", infinite=True
    )
    damper_step: float = limit("change of the motor force within one interval", 200.0, "N", infinite=True)
    damper_command: float = limit("motor force", 1000.0, "N")
    table_displacement: float = limit("table displacement", 0.40, "m")
    table_acceleration: float = limit("table acceleration", 30.0, "m/s²")
    damper_stroke: float = limit("damper stroke", 0.40, "m")
    damper_force: float = limit("damper force", 1000.0, "N")
    numerical_drift: float = limit(
        "energy that the integration makes or loses, over the energy put in", 0.1, infinite=True
    )
    error_energy: float = limit(
        "energy of the interface's displacement error, over the energy put in", 1.0, infinite=True
    )


@dataclass(frozen=True)
class Tolerances:
    """How well each nominal parameter is known, relative: one standard deviation. A diagnosis allows up to three."""

    default: float = key("for every parameter not named", default=0.02, least=0.0, most=1.0)
    parameters: dict[str, float] = key(
        'for single ones, as "table.delay" or "structure.mass"; a diagnosis lists them', default={}, more=True
    )


@dataclass(frozen=True)
class ReportTable:
    """What reports say of a test beside its data; it does not change the test."""

    laboratory: str = key("name of the laboratory", default="")
    operator: str = key("who runs the test", default="")
    specimen: str = key("what is tested", default="")
    notes: str = key("anything else that a report shall say", default="")
    calibration: dict[str, Any] = key(
        "calibration of each sensor by its signal: date, due (until when it holds), by, certificate",
        default={},
    )


@dataclass(frozen=True)
class RecordingTable:
    """Where recordings go, and whether a test may run without one."""

    folder: str = key("folder of recordings, relative to where the command is started", default="runs")
    required: bool = key("whether the test waits for a recorder and stops without it", default=True)
    patience: float = key(
        "silence of the recorder after which the test stops, and time for what it lacks to be sent again",
        default=10.0,
        unit="s",
        above=0.0,
    )
