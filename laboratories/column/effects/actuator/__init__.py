"""Effects on the transfer system of the column: servo valve, loop, piston, clevis."""
