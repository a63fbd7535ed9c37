"""Whole tests simulated with faults drawn from seeds, and the invariants that must hold in all of them."""
