"""The tables of a plan: their keys, defaults and allowed ranges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from common.plan.schema import NAME, Storeys, StoreysOrMatrix, inner, key


@dataclass(frozen=True)
class Test:
    """What the test is called, how long it lasts and its control interval."""

    __test__ = False  # not a test case of pytest

    name: str = key("name of the test, part of topics and file names", default="default", pattern=NAME)
    duration: float = key("length of the test", default=40.0, unit="s", above=0.0, most=7200.0)
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
    columns: NumericalColumnsTable = inner(NumericalColumnsTable)
    experimental: Experimental | None = field(default=None, metadata={"table": Experimental, "more": False})


@dataclass(frozen=True)
class Column:
    """The experimental column of laboratory A."""

    model: str = key("name of a specimen model", default="linear")
    stiffness: float = key("elastic stiffness of the specimen", default=12.5e6, unit="N/m", least=0.0)
    storey: int = key("storey in which the specimen stands", default=1, least=1)
    columns_per_storey: int = key("columns of that storey", default=4, least=1)
    represents: int = key("columns of the storey that the specimen stands for", default=1, least=1)
    deformation_ratio: float = key("specimen deformation over storey drift", default=0.5, above=0.0)
    mass: float = key("moving mass of the specimen, felt by the load cell", default=0.0, unit="kg", least=0.0)
    damping: float = key(
        "dashpot of the specimen, felt by the load cell", default=0.0, unit="N·s/m", least=0.0
    )
    parameters: dict[str, float] = key("parameters of the model beside the stiffness", default={}, more=True)


@dataclass(frozen=True)
class ServoHydraulics:
    """Nominal servo-hydraulic actuator in interaction with its specimen: `model = "servo_hydraulic"`.

    `q̈ + β1·q̇ + β2·q = a1β0·(g·u − x)`, `ḟ = −a3·f + q − a2·ẋ`, `m·ẍ + c·ẋ + f_model(x) = f`, with the specimen's
    mass, dashpot and model of `[column]`.
    """

    gain: float = key("g: factor on the command", default=1.0261, above=0.0)
    valve: float = key(
        "a1β0: gain of controller and servo valve", default=2.1283e13, unit="N/(m·s³)", above=0.0
    )
    valve_damping: float = key("β1 of the valve's dynamics", default=425.0, unit="1/s", above=0.0)
    valve_stiffness: float = key("β2 of the valve's dynamics", default=9.9976e4, unit="1/s²", above=0.0)
    leakage: float = key("a3: loss of force by leakage", default=3.3, unit="1/s", least=0.0)
    piston: float = key(
        "a2: force that a motion of the piston takes from the oil", default=4.2297e6, unit="N/m", above=0.0
    )
    delay: float = key("dead time of the command", default=0.0, unit="s", least=0.0, most=1.0)


@dataclass(frozen=True)
class Actuator:
    """Nominal hydraulic actuator: a first-order lag with dead time, `T·ẏ + y = K·u(t − L)`, or servo-hydraulics."""

    model: str = key(
        "fopdt for the first-order lag with dead time, servo_hydraulic for `[actuator.servo]`",
        default="fopdt",
        choices=("fopdt", "servo_hydraulic"),
    )
    gain: float = key("fopdt: static gain", default=1.0, above=0.0)
    delay: float = key("fopdt: dead time L", default=0.014, unit="s", least=0.0, most=1.0)
    time_constant: float = key("fopdt: time constant T, 0 for none", default=0.030, unit="s", least=0.0)
    command: str = key(
        "ramp: the command of a tick is reached at the interval's end; held: it acts as a step from the tick on",
        default="ramp",
        choices=("ramp", "held"),
    )
    servo: ServoHydraulics = inner(ServoHydraulics)


PAPER_COMPENSATOR = {"lead": 0.044, "proportional": 1.93, "integral": 0.047, "derivative": 0.0}


@dataclass(frozen=True)
class ForceCorrection:
    """Phase lead of the measured column force before it enters the equation of motion."""

    cutoff: float = key(
        "corner frequency of the high-pass filter, 0 for none", default=0.0, unit="Hz", least=0.0
    )
    unity: float = key("frequency at which the filter's gain is one", default=2.0, unit="Hz", above=0.0)
    unit_delay: bool = key(
        "whether the force enters the equation of motion one interval after it was measured", default=False
    )


@dataclass(frozen=True)
class CompensatorTable:
    """Compensation of the actuator's delay."""

    kind: str = key("name of a compensator", default="pid_taylor")
    parameters: dict[str, float] = key("its parameters", default=PAPER_COMPENSATOR, more=True)
    force: ForceCorrection = inner(ForceCorrection)


@dataclass(frozen=True)
class TableCompensator:
    """Compensation of the shaking table, computed by the slave."""

    kind: str = key("name of a compensator", default="none")
    parameters: dict[str, float] = key("its parameters", default={}, more=True)


@dataclass(frozen=True)
class ShakingTable:
    """Nominal second-order model with dead time of the shaking table."""

    frequency: float = key(
        "natural frequency, inf for an ideal table", default=15.0, unit="Hz", above=0.0, infinite=True
    )
    damping_ratio: float = key("damping ratio", default=0.7, unit="", above=0.0)
    delay: float = key("dead time", default=0.004, unit="s", least=0.0, most=1.0)
    compensator: TableCompensator = inner(TableCompensator)


@dataclass(frozen=True)
class Damper:
    """Nominal model of the active mass damper and its scale to the building."""

    mass: float = key("moving mass", default=16.0, unit="kg", above=0.0)
    stiffness: float = key("spring", default=56.8, unit="N/m", least=0.0)
    damping: float = key("dashpot", default=6.0, unit="N·s/m", least=0.0)
    motor_time_constant: float = key("lag of the motor force", default=0.003, unit="s", least=0.0)
    force_scale: float = key(
        "λ: force on the building over force in the laboratory", default=100.0, least=0.0
    )
    floor: int = key("floor on which the damper stands", default=1, least=1)


@dataclass(frozen=True)
class Control:
    """Velocity feedback of the damper."""

    amd: bool = key("whether the building carries the damper", default=True)
    gain: float = key(
        "G: damping force on the building over floor velocity", default=120_000.0, unit="N·s/m", least=0.0
    )


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
    """How well each nominal parameter is known, relative."""

    default: float = key("for every parameter not named", default=0.02, least=0.0, most=1.0)
    parameters: dict[str, float] = key('for single ones, as "part.parameter"', default={}, more=True)


@dataclass(frozen=True)
class RigTable:
    """The laboratory behind the rig interface.

    A class is code that runs with your rights: only run plans that you trust.
    """

    class_: str = key(
        "'file.py:Class' or 'package.module:Class', whose code the test then runs; empty for the emulated laboratory",
        default="",
    )
    options: dict[str, Any] = key("keyword arguments of the class", default={})


@dataclass(frozen=True)
class DeviceTable:
    """What a laboratory of a kind of the user's takes from the plan, beside that kind's own class."""

    place: int = key("storey whose drift, or floor whose motion, the device follows", default=1, least=1)
    ratio: float = key("target of the device over that motion", default=1.0, above=0.0)
    scale: float = key("force on the building over force in the laboratory", default=1.0)
    compensator: TableCompensator = inner(TableCompensator)
    parameters: dict[str, Any] = key("nominal parameters in place of those of the class", default={})
    limits: dict[str, Any] = key("limits in place of those of the class", default={})
    noise: dict[str, Any] = key("rms noise of readings in place of that of the class", default={})


@dataclass(frozen=True)
class LaboratoryTable:
    """Master or slave: what stands in its laboratory.

    The slave without a name has the plan's own tables: of the master's kind it is a twin of the master's laboratory.
    """

    rig: RigTable = inner(RigTable)
    kind: str = key(
        "kind of laboratory: column, table, none, or 'file.py:Class' of one's own; empty: a master's is column, a "
        "slave's table",
        default="",
    )


@dataclass(frozen=True)
class SlaveLaboratory:
    """One of several slaves: what stands in its laboratory, and its interface to the structure.

    A key that the plan gives in a table of this slave, `[slave.NAME.table]` for example, holds for this slave; the
    others are those of the plan's own table of that name. A compensator is taken whole.
    """

    table: ShakingTable = ShakingTable()
    damper: Damper = Damper()
    control: Control = Control()
    rig: RigTable = field(default_factory=RigTable)
    kind: str = ""
    actuator: Actuator = Actuator()
    column: Column = Column()
    compensator: CompensatorTable = CompensatorTable()
    device: DeviceTable = DeviceTable()


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
