"""A diagnosis report for people: its schema, a look on the terminal, one page."""
