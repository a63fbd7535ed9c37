"""The parameter that all friction in the catalogue shares: the velocity below which its force decreases."""

from __future__ import annotations

from laboratories.effects.effect import Parameter

VELOCITY = Parameter(
    "velocity",
    "m/s",
    null=1e-06,
    least=1e-06,
    most=0.05,
    sizes=(0.0003, 0.001, 0.003),
    says="velocity below which the force decreases, F·tanh(|v|/velocity); at its least value it is Coulomb friction",
    shape=True,
    # of the peak velocity: a fit then has a gradient, and the force is still constant for most of a cycle
    smoothing=0.03,
)
