"""Several recordings side by side: histories over the time since the start, peaks, indicators, differences of plans."""
