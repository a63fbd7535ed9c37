"""The machine under a test: its clocks, real-time shape and pauses, the signals it sends, other tests on it."""
