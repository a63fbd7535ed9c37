"""A campaign of tests as text and as a page: what was tried, why, how the probabilities moved, how it ended."""
