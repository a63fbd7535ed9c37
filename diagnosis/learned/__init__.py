"""Residuals that no effect explains, learned at their site as a force or a displacement over state and history."""
