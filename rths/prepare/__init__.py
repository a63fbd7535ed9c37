"""Commands before a test: plans, machine, keys, component tests and simulations."""
