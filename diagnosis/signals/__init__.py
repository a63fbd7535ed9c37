"""Signals and residuals by themselves, before any model: noise, quantum, windows, bands, ceilings."""
