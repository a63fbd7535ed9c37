"""The analysis of a plan by nominal models before the test: partition, paths, peaks, stability."""
