"""What the operator's panel does on this machine: it checks, runs a test as a command of its own, and orders."""
