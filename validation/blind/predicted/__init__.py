"""Predictions of the blind trial: the next test of every case, predicted with what a diagnosis found, and judged."""
