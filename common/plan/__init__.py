"""The plan of a test as a file: its tables and keys, their checks, differences between plans."""
