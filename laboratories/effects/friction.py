"""Constants of all friction in the catalogue: the velocity below which it falls off."""

from __future__ import annotations

from laboratories.effects.effect import Parameter

VELOCITY = Parameter(
    "velocity",
    "m/s",
    null=1e-06,
    least=1e-06,
    most=0.05,
    sizes=(0.0003, 0.001, 0.003),
    says="below which it falls off, F·tanh(|v|/velocity); at its least it is Coulomb's",
    shape=True,
    smoothing=0.03,  # of the peak velocity: smooth enough that a fit has a slope to follow, far from viscous
)
