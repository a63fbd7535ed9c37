"""What signals and residuals say by themselves, before any model: noise, quantum, windows, bands, ceilings."""
