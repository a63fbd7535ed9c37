"""What a recording could not show, and which further test would tell the remaining candidates apart."""
