"""Data of another logger as signals of a recording: the map of its columns, and their rows on the ticks."""
