"""Energy that tracking errors put into a hybrid test."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from models.indicators.checks import checked
from models.registry import Array


def hybrid_simulation_error_energy(
    target: Array, measured: Array, force: Array, input_energy: Array, strain_energy: float
) -> Array:
    """Running error energy at the interface over the energy in the test so far (n,).

    `∫ f dx_m − ∫ f dx_t` over the largest input energy so far plus `strain_energy` (J), the elastic energy
    that the structure can store. `target` and `measured` (n,) m, `force` (n,) N measured, `input_energy`
    (n,) J. Positive where the specimen takes more work than the numerical part gave: the transfer system
    has put energy into the loop, as a delay does.

    Raises:
        InputError: signals empty, unequal, not finite, or a strain energy that is not positive.

    Source: Mosqueda, Stojadinovic and Mahin, Real-time error monitoring for hybrid simulation, J. Struct.
    Eng. 133 (2007); Ahmadizadeh and Mosqueda (2009).
    """
    checked(target=target, measured=measured, force=force, input_energy=input_energy)
    if not strain_energy > 0.0:
        raise InputError(f"The strain energy is {strain_energy:g} J, but must be above 0.")
    mean = 0.5 * (force[1:] + force[:-1])
    error = np.concatenate([[0.0], np.cumsum(mean * np.diff(measured - target))])
    return np.asarray(error / (strain_energy + np.maximum.accumulate(np.maximum(input_energy, 0.0))))
