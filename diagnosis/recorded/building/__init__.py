"""The building of a test: as the master computed it, and as one whose forces a data logger recorded."""
