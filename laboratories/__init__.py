"""Kinds of laboratory: what is known of each stands in its own folder."""
