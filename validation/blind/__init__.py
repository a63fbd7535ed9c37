"""The blind trial: cases with a hidden effect, diagnosed by a process that sees the recordings only, and scored."""
