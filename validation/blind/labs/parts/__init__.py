"""The mechanics of the blind trial's laboratories, written apart from `models`: no model is judged by itself."""
