"""Effects on the network between the laboratories."""
