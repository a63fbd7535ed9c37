"""What a plan describes, for its author: figures, likely slips of units, classes that it would run."""
