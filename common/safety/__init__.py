"""How a laboratory keeps itself safe: its state machine, its watchdog, its ramp to rest."""
