"""The safety of a laboratory: its state machine, its watchdog, its ramp to rest."""
