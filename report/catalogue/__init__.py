"""The catalogue of tests: one SQLite file beside recordings, with the circumstances, outcome and peaks of each."""
