"""The next test foretold: laboratories drawn from what a diagnosis found, bands of their response, how they held."""
