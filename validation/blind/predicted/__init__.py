"""Predictions of the blind trial: the next test of every case, foretold with what a diagnosis found, and judged."""
