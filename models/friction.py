"""The size of a friction force at a speed: `F·tanh(|v|/v₀)·(1 − d·(1 − exp(−|v|/v_s)))`.

Below v₀ the force decreases to zero, which makes the law smooth. At higher speeds friction is lower than at low ones,
or higher if d < 0.

Before it slides, a contact gives way as if by bristles: after a reversal the force approaches its size F_s over a
distance, the presliding s₀: `dF/ds = (F_s − F)/s₀` with F_s against the motion.

B. Armstrong-Hélouvry, P. Dupont and C. Canudas de Wit, Automatica 30 (1994), 1083-1138, section 2. P. R. Dahl, A
solid friction model, Aerospace Corporation TOR-0158(3107-18)-1 (1968).
"""

from __future__ import annotations

import numpy as np

from models.compiled import jit

COULOMB = 1e-6  # m/s; with v₀ up to this value the force does not decrease at low speed: Coulomb friction
# Ratios of speeds from which on 1 − tanh and exp are below what a number holds beside 1: neither needs to be computed.
TANH_IS_ONE, EXP_IS_NOTHING = 20.0, 40.0
SHORT = 1e-4  # of an exponent: the fourth power of such a step is below what a number holds beside 1


@jit
def left(rate: float, velocity: float, drop: float, speed: float) -> float:
    """The factor on a friction force at a rate (m/s): v₀ = `velocity` and v_s = `speed` in m/s, d = `drop`."""
    size = abs(rate)
    share = 1.0
    if velocity > COULOMB and size <= TANH_IS_ONE * velocity:
        fallen = np.exp(-2.0 * size / velocity)
        share = (1.0 - fallen) / (1.0 + fallen)  # tanh, whose own function takes twice as long
    if drop != 0.0:
        beyond = 0.0 if size > EXP_IS_NOTHING * speed else np.exp(-size / speed)
        share *= 1.0 - drop * (1.0 - beyond)
    return float(share)


@jit
def faded(left: float, far: float, step: float) -> float:
    """e^(−far), the share of a bend that bristles still have after a way: by a series over a short last step.

    `left` is that share before this step, e^(step − far).
    """
    if abs(step) > SHORT:
        return float(np.exp(-far))
    return left * (1.0 - step * (1.0 - step * (0.5 - step / 6.0)))


@jit
def dahl(force: float, moved: float, least: float, most: float, presliding: float) -> float:
    """The force (N) of bristles after a move (m), from the force before; they slide at `least` or at `most` N."""
    end = most if moved > 0.0 else least
    return float(end + (force - end) * np.exp(-abs(moved) / presliding))
