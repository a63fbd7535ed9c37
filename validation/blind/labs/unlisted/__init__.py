"""Effects of no catalogue of the trial's own laboratories, for the sets `unlisted` and `unlisted_tune`."""
