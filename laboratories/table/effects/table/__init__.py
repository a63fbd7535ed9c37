"""Effects on the shaking table of laboratory B: drive, loop, platform."""
