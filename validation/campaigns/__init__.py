"""Campaigns in hidden laboratories of the blind trial: chosen tests beside random ones."""
