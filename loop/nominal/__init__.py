"""What nominal models say of a plan before the test: partition, paths, peaks, stability."""
