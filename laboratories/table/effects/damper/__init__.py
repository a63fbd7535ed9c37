"""Effects on the active mass damper: mass, spring, rail, motor, end stops."""
