"""The results of the fits: the verdict on each part, candidates, where the gap lies, how far it closes, the report."""
