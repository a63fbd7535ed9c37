"""The wire by which OpenSees and OpenFresco talk to a laboratory: bytes to values and back, and a server's states."""
