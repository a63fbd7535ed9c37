"""Effects on the specimen of a column laboratory and on its fixtures."""
