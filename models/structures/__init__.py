"""Numerical substructures."""
