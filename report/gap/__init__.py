"""A diagnosis report for people: a summary on the terminal, and one page."""
