"""Effects on the ground motion that the building gets."""
