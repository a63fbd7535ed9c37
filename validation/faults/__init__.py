"""Whole tests simulated with faults drawn from seeds, and what must hold in all of them."""
