"""A diagnosis report for people: a look on the terminal, one page."""
