"""What a recording amounts to: peaks, completeness, late ticks, accounts of messages, storeys, parameters."""
