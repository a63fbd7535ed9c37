"""What a prediction takes from a diagnosis: the laboratories as they were found, and how far that may be wrong."""
