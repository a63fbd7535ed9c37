"""Effects on laboratories of the kind `column`, by site."""
