"""The noise of sensors as the residuals of a part show it, and what of these residuals inputs foresee."""
