"""Data loggers of the blind trial: what each makes of a channel, and the recording that it leaves."""
