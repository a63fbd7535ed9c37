"""Effects on the shaking table: drive, servo loop, platform."""
