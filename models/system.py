"""The system under test: a plan's nominal models, and the unmodelled effects applied to them.

With every effect at its null value a system behaves exactly as the plan alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from common.plan.plan import Plan


@dataclass(frozen=True)
class ActuatorEffects:
    """Effects on an actuator, beyond the plan's model."""

    lag_damping: float = math.inf  # ratio of a loop of second order, infinite for one of first order
    velocity_limit: float = math.inf  # m/s
    velocity_limit_sharpness: float = math.inf  # with which the speed bends at its limit
    stall_force: float = math.inf  # N, load at which the piston stands
    backlash: float = 0.0  # m, whole play
    backlash_law: float = (
        0.0  # 0 behind the loop, between piston and specimen, 1 before the loop, 2 behind, greased
    )
    spring_back: float = 0.01  # s, in which a specimen springs back through greased play
    compliance: float = 0.0  # m/N
    compliance_law: float = 0.0  # 0 behind the loop, between piston and specimen, 1 within the loop
    deadband: float = 0.0  # m, whole band of the loop's error without flow
    deadband_law: float = 0.0  # 0 with sharp edges, 1 with edges that leak, 2 with lands that leak
    null_gain: float = 0.1  # flow gain at null over that outside, of an overlap with lands that leak
    learned: tuple[float, ...] = ()  # a law of `models.preisach` that adds to the motion, m


@dataclass(frozen=True)
class ColumnEffects:
    """Effects on a specimen, beyond the plan's model."""

    yield_displacement: float = math.inf  # m
    hardening: float = 0.0
    exponent: float = 2.0  # sharpness of the transition: Bouc-Wen's n, Menegotto and Pinto's R₀, also of bars
    yield_loop: float = 0.5  # Bouc-Wen's β: 0.5 unloads elastically, 1 is the endochronic law
    law: float = 0.0  # index of the law of yielding in `laboratories.column.specimen.LAWS`
    turn: float = 0.0  # reversal over the yield displacement below which Menegotto and Pinto's branch goes on
    unloading: float = 0.0  # exponent of the unloading stiffness, of a peak-oriented or pinched specimen
    first_bend: float = 1.0  # of a trilinear or pinched specimen, over the yield displacement
    second_stiffness: float = 0.5  # between the bends, over the first
    pinch_force: float = 1.0  # of a pinched specimen: the corner of reloading, over the peak's force
    pinch_displacement: float = (
        1.0  # and its place: on the way to the peak, of the peak, or of where it unloads to
    )
    damage: float = 0.0  # growth of that peak per plastic deformation of the yield displacement
    yield_asymmetry: float = 0.0  # strength of its positive side less that of the negative one over their sum
    strength_loss: float = 0.0  # of a degrading Bouc-Wen specimen: δ_ν, per energy over k·δ_y²
    stiffness_loss: float = 0.0  # likewise δ_η
    pinch_depth: float = 0.0  # ζ_s, share of its slope that pinching takes at last
    pinch_place: float = 0.1  # q, where pinching is deepest, over the largest force
    pinch_rate: float = 0.1  # p, at which pinching sets in, per that energy
    pinch_width: float = 0.3  # ψ
    pinch_spread: float = 0.5  # λ, width over depth of pinching
    concrete: float = 5.0  # of a section of layers: stiffness of the concrete over that of the bars
    axial: float = 0.0  # axial force over that at which all bars yield
    concrete_strength: float = 0.5  # over its stiffness times the bars' yield strain
    spalling: float = 0.0  # share of their strength that outer layers lose per strain at which bars yield
    shaft: float = 0.6  # share of the flexibility outside the section
    focus: float = 2.0  # strain in tension over that at which bars yield to which concrete unloads
    core: float = 0.1  # share of the spalling that the core has
    rubbing: float = 0.0  # friction of cracks over stiffness times yield displacement
    eccentricity: float = 0.0  # constant force over the same
    uncracked: float = 1.0  # first stiffness of that section over the planned one
    centring: float = math.inf  # m, deformation where a self-centring specimen bends
    centring_hardening: float = 0.05
    centring_loop: float = 0.5  # height of its flag over its force there
    stiffening: float = 0.0  # stiffness gained over the first one
    # 0 with the square of the deformation, 1 from a bend on, 2 from two bends on, 3 with another power
    stiffening_law: float = 0.0
    stiffening_exponent: float = 2.0  # of law 3
    stiffening_bend: float = 1e-3  # m
    stiffening_second: float = 0.0  # stiffness gained from a second bend on
    stiffening_second_bend: float = 2e-3  # m
    degradation: float = (
        0.0  # share of stiffness lost when the largest deformation is far beyond the reference
    )
    pinching: float = 0.0
    pinching_width: float = 1e-3  # m
    pinching_hardening: float = 0.0
    pinching_law: float = 0.0  # 0 a bell without tails, 1 with tails
    pinching_tails: float = 2.0  # how fast they fall
    friction: float = 0.0  # N
    presliding: float = 10e-6  # m, deformation of the friction's contact before it slides
    friction_velocity: float = (
        1e-6  # v of F·tanh(δ̇/v), m/s: below any motion of a test, so that it acts as Coulomb's
    )
    friction_asymmetry: float = 0.0  # share more in the positive direction, and less in the other
    friction_drop: float = 0.0  # share that is lost at speed
    friction_speed: float = 0.02  # m/s, at which two thirds of that are lost
    friction_law: float = 0.0  # 2: a slider in the place of the planned specimen
    friction_stiffness: float = 1e7  # N/m, of that slider's joint
    viscous: float = 0.0  # N·s/m
    # 1: a power of the rate, 2: behind a spring, in the place of the planned specimen, 3: beside it, 4: as 1 in the
    # place of the planned dashpot
    viscous_law: float = 0.0
    viscous_exponent: float = 1.0  # of the rate
    viscous_stiffness: float = 1e7  # N/m, of that spring
    inertia: float = 0.0  # kg
    slip: float = 0.0  # m, whole gap
    slip_law: float = 0.0  # where the gap is: `laboratories.column.specimen.PLAYS`
    slip_share: float = 1.0  # of the stiffness that is behind the gap; the rest is beside it
    slip_corner: float = 0.0  # m, length over which a gap with round corners closes
    learned: tuple[float, ...] = ()  # a law of `models.preisach` that adds to the force, N


@dataclass(frozen=True)
class TableEffects:
    """Effects on a shaking table, beyond a second-order system with dead time."""

    gain: float = 1.0
    oil_frequency: float = math.inf  # Hz
    oil_damping: float = 0.1
    oil_share: float = 1.0  # of the motion that passes through that resonance
    oil_law: float = 0.0  # 2 the dashpot lies between loop and platform
    feed_velocity: float = 0.0  # fed forward: share of what makes up for the loop's damping
    feed_acceleration: float = 0.0  # and for its inertia
    feed_lag: float = 0.001  # s, of the filter behind which both are computed
    second_frequency: float = math.inf  # Hz, of a mass that swings on the platform
    second_share: float = 0.1  # of the mass that the loop moves
    second_damping: float = 0.03  # ratio at that frequency
    second_law: float = (
        0.0  # 0 the loop opposes its stiffness, 1 its flow, 2 that of a platform without the mass
    )
    velocity_limit: float = math.inf  # m/s, at which the loop's valve is open
    velocity_limit_sharpness: float = math.inf  # with which the speed bends there
    compliance: float = 0.0  # m/N
    backlash: float = 0.0  # m, whole play
    backlash_law: float = 0.0  # 0 before the loop, 1 between loop and platform
    flank_frequency: float = 100.0  # Hz, of the platform on the flanks of the play of law 1
    flank_damping: float = 0.5  # ratio there
    guide: float = 0.0  # 1/s, at which the platform takes the loop's velocity inside the play
    friction: float = 0.0  # m/s²: force over moving mass
    friction_velocity: float = 1e-6  # m/s, as in `ColumnEffects`
    friction_asymmetry: float = 0.0  # share more in the positive direction, and less in the other
    friction_drop: float = 0.0  # share that is lost at speed
    friction_speed: float = 0.02  # m/s, at which two thirds of that are lost
    presliding: float = 0.0  # m, in which the friction's bristles bend; 0 for a friction that sticks at once
    learned: tuple[float, ...] = ()  # a law of `models.preisach` of the table's motion that brakes it, m/s²


@dataclass(frozen=True)
class DamperEffects:
    """Effects on an active mass damper, beyond a spring, a dashpot and a motor with lag."""

    gain: float = 1.0
    friction: float = 0.0  # N
    friction_velocity: float = 1e-6  # m/s, as in `ColumnEffects`
    friction_asymmetry: float = 0.0  # share more in the positive direction, and less in the other
    friction_drop: float = 0.0  # share that is lost at speed
    friction_speed: float = 0.02  # m/s, at which two thirds of that are lost
    presliding: float = 0.0  # m, in which the friction's bristles bend; 0 for a friction that sticks at once
    force_limit: float = math.inf  # N
    force_limit_sharpness: float = math.inf  # of the bend there, as in `models.saturation`
    offset: float = 0.0  # N, a constant force on the moving mass
    offset_outside: float = 0.0  # 1 where its reaction acts elsewhere than on the table
    motor_damping: float = math.inf  # ratio of a motor of second order, infinite for one of first order
    asymmetry: float = 0.0  # share by which the dashpot is stronger in the positive direction
    damping_exponent: float = 1.0  # n of a dashpot whose force grows with the speed to the power of n
    stiffening: float = 0.0  # 1/m², share of its stiffness that the spring gains with the stroke squared
    second_frequency: float = math.inf  # Hz, of a share of the mass on the coupling that it lies behind
    second_mass: float = 0.2  # that share
    second_damping: float = 0.1  # ratio of the coupling's dashpot to the critical one of that share
    second_play: float = 0.0  # m, whole play of the coupling
    stop_stroke: float = math.inf  # m
    stop_stiffness: float = 0.0  # N/m
    stop_exponent: float = 1.0  # of the depth, as in `models.stops`
    stop_damping: float = 0.0  # s/m
    learned: tuple[
        float, ...
    ] = ()  # a law of `models.preisach` for a force of the stroke beside the spring's, N


@dataclass(frozen=True)
class SensorEffects:
    """Effects on a sensor: `saturated(gain·delayed(passed(lagged(value)))) + bias + drift·t + noise`, rounded."""

    gain: float = 1.0
    bias: float = 0.0
    drift: float = 0.0  # per s
    lag: float = 0.0  # s
    lag_damping: float = math.inf  # ratio of a lag of second order, infinite for one of first order
    high_pass: float = math.inf  # s
    quantization: float = 0.0
    noise: float = 0.0  # rms, in addition to the plan's
    delay: float = 0.0  # s
    saturation: float = math.inf  # level that no reading exceeds, bias aside
    saturation_sharpness: float = 2.0  # n of x/(1 + |x/level|ⁿ)^(1/n)
    # s by which a data logger recorded the reading later than its map states, less than zero for earlier; no
    # laboratory has it
    logger_delay: float = 0.0


@dataclass(frozen=True)
class LinkEffects:
    """Effects on the network between the laboratories, in both directions."""

    delay: float = 0.0  # s
    jitter: float = 0.0  # s, standard deviation
    jitter_shape: float = 1.0  # of its Gamma distribution
    loss: float = 0.0  # share of messages
    burst: float = 1.0  # mean messages lost in a row


@dataclass(frozen=True)
class Effects:
    """All effects that no plan describes; null by default."""

    time_shift: float = 0.0  # s, of the ground motion
    p_delta: float = 0.0  # N/m, of every storey
    actuator: ActuatorEffects = ActuatorEffects()
    column: ColumnEffects = ColumnEffects()
    table: TableEffects = TableEffects()
    damper: DamperEffects = DamperEffects()
    link: LinkEffects = LinkEffects()
    sensors: dict[str, SensorEffects] = field(default_factory=dict)
    device: dict[str, float] = field(
        default_factory=dict
    )  # parameters that effects set on a user's device, by name


def times(factor: float, value: Any) -> Any:
    """A number, or every number of nested tuples, multiplied by a factor."""
    return tuple(times(factor, item) for item in value) if isinstance(value, tuple) else factor * value


@dataclass(frozen=True)
class System:
    """A plan, whose parameters may differ from the nominal ones, with effects."""

    plan: Plan
    effects: Effects = field(default_factory=Effects)

    @property
    def unread(self) -> System:
        """The system with sensors without error."""
        return replace(self, effects=replace(self.effects, sensors={})) if self.effects.sensors else self

    def scaled(self, table: str, name: str, factor: float) -> System:
        """The system with one parameter of the plan multiplied, in every storey or entry of a matrix.

        `name` may be that of a parameter in an inner table, such as `servo.gain`. The part of the structure that the
        specimen takes over is multiplied too, so that the numerical part has the same factor.
        """
        part = getattr(self.plan, table)
        inner, _, key = name.rpartition(".")
        if inner:
            within = getattr(part, inner)
            return self.moved(table, **{inner: replace(within, **{key: factor * getattr(within, key)})})
        values = {name: times(factor, getattr(part, name))}
        if table == "structure" and part.experimental is not None:
            own = name.removesuffix("_ratio")
            left_out = {own: factor * getattr(part.experimental, own)}
            values["experimental"] = replace(part.experimental, **left_out)
        return self.moved(table, **values)

    def moved(self, table: str, **values: Any) -> System:
        """The system with parameters of one of the plan's tables replaced."""
        part = replace(getattr(self.plan, table), **values)
        return replace(self, plan=replace(self.plan, **{table: part}))

    def laid(self, part: str, **values: float | tuple[float, ...]) -> System:
        """The system with effects on one part replaced; `part` is a field of `Effects` that holds a dataclass."""
        changed = replace(getattr(self.effects, part), **values)
        return replace(self, effects=replace(self.effects, **{part: changed}))

    def sensed(self, signal: str, **values: float) -> System:
        """The system with the effects on one sensor replaced."""
        sensors = self.effects.sensors
        changed = replace(sensors.get(signal, SensorEffects()), **values)
        return replace(self, effects=replace(self.effects, sensors=sensors | {signal: changed}))

    def recorded(self, *signals: str, delay: float = 0.0, gain: float = 1.0) -> System:
        """The system of which a logger records readings, with their sensors' errors, late (s) and times a gain."""
        sensors = dict(self.effects.sensors)
        for signal in signals:
            own = sensors.get(signal, SensorEffects())
            values = {name: gain * getattr(own, name) for name in ("gain", "bias", "drift", "saturation")}
            sensors[signal] = replace(own, logger_delay=own.logger_delay + delay, **values)
        return replace(self, effects=replace(self.effects, sensors=sensors))
