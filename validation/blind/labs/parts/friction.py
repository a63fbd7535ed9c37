"""Dry friction as a force per unit of the Coulomb force, against motion."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import jit

NONE, TANH, DAHL, LUGRE = range(4)
STRIBECK = 0.15  # excess of static over sliding friction; the paper of LuGre simulates 0.5, lubricated guides have less


@jit
def regularised(velocity: float, scale: float) -> float:
    """Smooth Coulomb friction, `tanh(v/v0)`: it creeps under load instead of sticking."""
    return math.tanh(velocity / scale)


@jit
def dahl(bristle: float, moved: float, presliding: float) -> float:
    """Deflection (in units of `presliding`) after a move: `dz/ds = 1/z0·(1 − z·sgn(ds))`, exact.

    P. R. Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1, 1968.
    """
    end = math.copysign(1.0, moved)
    return end + (bristle - end) * math.exp(-abs(moved) / presliding)


@jit
def stribeck(velocity: float, scale: float) -> float:
    """Sliding friction over Coulomb's: `1 + (F_s/F_c − 1)·exp(−(v/v_s)²)`."""
    return 1.0 + STRIBECK * math.exp(-((velocity / scale) ** 2))


@jit
def lugre(bristle: float, moved: float, velocity: float, presliding: float, scale: float) -> float:
    """Deflection (in units of `presliding`) after a move: `ż = v/z0 − |v|·z/(z0·g(v))`, g held over the move.

    C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, A new model for control of systems with
    friction, IEEE Trans. Autom. Control 40 (1995) 419-425.
    """
    end = math.copysign(stribeck(velocity, scale), moved)
    return end + (bristle - end) * math.exp(-abs(moved) / (presliding * abs(end)))


@jit
def lugre_force(bristle: float, velocity: float, presliding: float, scale: float, micro: float) -> float:
    """Force over Coulomb's: `z + σ1·ż`, `micro` = σ1·z0/F_c in seconds."""
    rate = (velocity - abs(velocity) * bristle / stribeck(velocity, scale)) / presliding
    return bristle + micro * rate


@jit
def after(
    formula: float, bristle: float, moved: float, velocity: float, presliding: float, scale: float
) -> float:
    """Deflection after a move under a formula; none where it has no memory."""
    if formula == DAHL:
        return dahl(bristle, moved, presliding)
    if formula == LUGRE:
        return lugre(bristle, moved, velocity, presliding, scale)
    return 0.0


@jit
def share(
    formula: float, bristle: float, velocity: float, presliding: float, scale: float, micro: float
) -> float:
    """Force over Coulomb's under a formula, at a deflection of the bristles."""
    if formula == TANH:
        return regularised(velocity, scale)
    if formula == LUGRE:
        return lugre_force(bristle, velocity, presliding, scale, micro)
    return bristle
