"""The figures of a recording: peaks, completeness, late ticks, accounts of messages, storeys, parameters."""
