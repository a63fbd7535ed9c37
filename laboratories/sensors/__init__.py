"""Sensors of an emulated laboratory: their readings and their noise."""
