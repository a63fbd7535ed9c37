"""A case of the blind trial: the plan, true parameters, effects in laboratories and their names."""
