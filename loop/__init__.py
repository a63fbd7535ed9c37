"""The hybrid test as one simulated loop: building, laboratories and exchange, and what nominal models say of a plan."""
