"""Predictions of the next test: laboratories drawn from a diagnosis, bands of their response, whether a band held."""
