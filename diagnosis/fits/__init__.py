"""Fits of hypotheses to a part: which effects might explain it, how large they may be, what a search selects."""
