"""Effects on laboratories of the kind `table`, by site."""
