"""Effects on the ground motion of the building."""
