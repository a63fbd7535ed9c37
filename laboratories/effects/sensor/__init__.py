"""Effects on readings; each exists once per signal."""
