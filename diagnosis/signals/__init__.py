"""Signals and residuals by themselves, before any model: noise, windows, bands, ceilings."""
