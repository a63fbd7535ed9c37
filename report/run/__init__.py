"""The report of a run: the contents of its page, section by section."""
