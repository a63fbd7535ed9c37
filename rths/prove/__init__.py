"""Commands that check rths itself: blind trial, drawn faults, the public benchmark, the seed paper."""
