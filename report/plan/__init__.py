"""A description of a plan for its author: figures, likely slips of units, classes that it would run."""
