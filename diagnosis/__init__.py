"""Where a recording differs from its simulation, which effect causes it, and how far modelling it closes the gap."""
