"""What a plan describes, for whoever has just written it: figures, likely slips of units, classes that it would run."""
