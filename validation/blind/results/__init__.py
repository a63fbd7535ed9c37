"""Results of a blind trial: answers scored against the truth, rates with their intervals, tables and the page."""
