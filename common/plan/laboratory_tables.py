"""The tables of a plan that describe a laboratory: its rig, transfer system, specimen or device, and compensator."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from common.plan.schema import inner, key


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
class RigTable:
    """The laboratory behind the rig interface: emulated, a class of the user's, or a rig in another process.

    A class is code that runs with your rights: only run plans that you trust.
    """

    class_: str = key(
        "'file.py:Class' or 'package.module:Class', whose code the test then runs; empty for the emulated laboratory",
        default="",
    )
    options: dict[str, Any] = key(
        "keyword arguments of the class; one called file is a path from the plan's folder", default={}
    )
    address: str = key(
        "udp/HOST:PORT of a rig in another process, or udp/PORT on this machine; empty for none", default=""
    )
    answer_share: float = key(
        "share of the interval that a tick waits for the answer of a rig at an address",
        default=0.25,
        above=0.0,
        most=0.9,
    )
    arm_timeout: float = key(
        "time in which a rig at an address gets ready", default=10.0, unit="s", above=0.0, most=3600.0
    )

    @property
    def own(self) -> bool:
        """Whether it is a rig of the user's, no emulated one."""
        return bool(self.class_ or self.address)


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
    """Master or slave: its kind of laboratory and its rig.

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
    """One of several slaves: its kind of laboratory, its rig, and its interface to the structure.

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
