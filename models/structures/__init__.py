"""Numerical models of buildings."""
