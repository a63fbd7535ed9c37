"""How messages get from one process to another: zenoh or memory, who may say what, delays, what is rejected."""
