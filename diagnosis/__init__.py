"""Where a recording and its simulation part, which effect does it, and how far naming it closes the gap."""
