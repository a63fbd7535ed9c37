"""OpenSees as a specimen in another process, and the messages by which OpenSees and OpenFresco command a laboratory."""
