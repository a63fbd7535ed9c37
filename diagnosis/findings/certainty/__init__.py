"""How sure a verdict is: its probability, and the intervals of its parameters."""
