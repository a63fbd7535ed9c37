"""Effects on the numerical substructure."""
