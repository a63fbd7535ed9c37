"""The machine under a test: its clocks, real-time settings and pauses, the signals it sends, other tests on it."""
