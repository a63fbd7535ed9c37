"""The mechanics of the blind trial's laboratories: written apart from `models`, so that none judges itself."""
