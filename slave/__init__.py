"""Laboratory B: drives the shaking table that carries the active mass damper."""
