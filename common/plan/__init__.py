"""The plan and the reality of a test as files: their tables and keys, their checks, differences between plans."""
