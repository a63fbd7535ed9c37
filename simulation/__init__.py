"""Whole tests and component tests in virtual time: the real loops and rigs in one process."""
