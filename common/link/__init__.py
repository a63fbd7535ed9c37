"""How messages get from one process to another: zenoh or memory, access control, delays, rejected frames."""
