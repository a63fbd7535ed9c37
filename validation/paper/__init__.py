"""The seed paper reproduced: its experiments on the emulated laboratories, its numbers, its figures, one page."""
