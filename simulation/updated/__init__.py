"""A plan whose nominal models are those that a diagnosis found, and what serves best on the laboratories found."""
