"""Effects on the specimen of laboratory A and on its fixtures."""
