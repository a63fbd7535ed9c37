"""What no effect explains, learned at its site as a force or a displacement over state and history."""
