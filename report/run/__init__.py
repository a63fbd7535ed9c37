"""The report of a run: what its page says, section by section."""
