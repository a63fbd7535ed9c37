"""Sensors of an emulated laboratory: what they read, and their noise."""
