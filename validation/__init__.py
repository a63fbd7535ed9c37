"""Proofs of rths itself: the blind trial of the diagnosis, drawn faults, the public benchmark, the seed paper."""
