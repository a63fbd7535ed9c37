"""What a case of the blind trial is made of: the plan, true parameters, effects in laboratories and their names."""
