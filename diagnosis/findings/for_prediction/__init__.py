"""The input of a prediction from a diagnosis: the laboratories as found, and the uncertainty of the findings."""
