"""Sweeps: the closed loop of one plan under many motions, scales, parameters, compensators and drawn laboratories."""
