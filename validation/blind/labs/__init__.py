"""Laboratories written independently of the diagnosis' models, as plug-in rigs.

They share no model with `models`: they integrate with Runge-Kutta in steps of at most 0.1 ms, and have other formulas
of the catalogue's effects. Effects whose names begin with `x.` are in no catalogue.
"""

from __future__ import annotations

SIGNALS = (
    "column_displacement",
    "column_force",
    "table_displacement",
    "table_acceleration",
    "damper_stroke",
    "damper_force",
)

FORMULAS: dict[str, tuple[str, ...]] = {
    "actuator.delay": ("pade",),
    "actuator.time_constant": ("valve",),
    "actuator.velocity_limit": ("smooth", "orifice"),
    "actuator.backlash": ("spring",),
    "actuator.compliance": ("oil_column",),
    "actuator.deadband": ("smooth",),
    "column.yielding": ("menegotto_pinto", "takeda", "ramberg_osgood"),
    "column.degradation": ("exponential", "linear"),
    "column.pinching": ("lorentz", "sech"),
    "column.friction": ("tanh", "dahl", "lugre"),
    "column.viscous": ("power", "maxwell"),
    "column.slip": ("smooth",),
    "column.hardening": ("sinh",),
    "table.delay": ("pade",),
    "table.payload": ("dynamic",),
    "table.backlash": ("contact",),
    "table.friction": ("tanh",),
    "damper.friction": ("tanh", "dahl", "lugre"),
    "damper.force_limit": ("smooth",),
    "damper.motor_lag": ("second_order",),
    "damper.stroke_stop": ("hertz", "linear"),
    **{f"sensor.{signal}.lag": ("butterworth",) for signal in SIGNALS},
    **{f"sensor.{signal}.saturation": ("tanh",) for signal in SIGNALS},
}
"""Formulas by effect of the catalogue, where they differ from the catalogue's."""

PLAIN: tuple[str, ...] = (
    "actuator.gain",
    "column.stiffness",
    "column.inertia",
    "table.bandwidth",
    "table.damping",
    "table.gain",
    "table.oil_column",
    "damper.viscous",
    "damper.stiffness",
    "damper.mass",
    "damper.second_mass",
    "damper.gain",
    *(
        f"sensor.{signal}.{kind}"
        for signal in SIGNALS
        for kind in ("gain", "bias", "drift", "quantization", "noise")
    ),
    *(f"sensor.{signal}.high_pass" for signal in ("column_force", "table_acceleration", "damper_force")),
)
"""Effects of the catalogue that these laboratories know in the textbook's formula, "plain"."""

UNCATALOGUED: dict[str, tuple[str, tuple[str, ...], tuple[tuple[float, float], ...]]] = {
    "x.actuator.ripple": ("actuator", ("amplitude", "frequency"), ((1e-5, 1.5e-4), (6.0, 25.0))),
    "x.actuator.droop": ("actuator", ("loss",), ((0.01, 0.3),)),
    "x.actuator.valve_hysteresis": ("actuator", ("width",), ((3e-5, 4e-4),)),
    "x.column.asymmetry": ("column", ("share",), ((0.01, 0.15),)),
    "x.table.pitch": ("table", ("coupling", "frequency"), ((0.1, 0.5), (15.0, 5.0))),
    "x.table.cam": ("table", ("amplitude", "period"), ((2e-5, 2e-4), (0.01, 0.04))),
    "x.damper.cable_drag": ("damper", ("coefficient",), ((1.5, 20.0),)),
    "x.damper.motor_constant": ("damper", ("rise",), ((0.02, 0.3),)),
    "x.damper.cubic_spring": ("damper", ("stiffness",), ((5e3, 8e4),)),
    "x.sensor.table_acceleration.crosstalk": (
        "sensor.table_acceleration",
        ("coefficient",),
        ((4e-4, 4e-3),),
    ),
    "x.sensor.column_force.missing": ("sensor.column_force", ("probability",), ((0.01, 0.3),)),
    "x.sensor.damper_force.missing": ("sensor.damper_force", ("probability",), ((0.01, 0.3),)),
}
"""Effects with no entry in the catalogue: site, parameters, and for each of these its weak and strong value.

The ranges are chosen for the default test: from an effect that noise may hide to one that no diagnosis should miss.
"""

ALIKE = {"x.damper.cubic_spring": ("damper.stiffness",)}
"""Of these the effects of the catalogue that have such a law, so that their names are right as well."""
