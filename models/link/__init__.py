"""The network between the laboratories, emulated."""
