"""Laws of one mechanism held against each other: which of them an effect follows, and where a fit of it starts."""
