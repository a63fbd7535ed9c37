"""Data loggers of the blind trial: how each changes a channel, and the recording that it writes."""
