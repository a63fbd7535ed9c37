"""A plan with the nominal models that a diagnosis found, and compensators tried on the laboratories as found."""
