"""What a blind trial found: answers scored against the truth, rates with their intervals, tables and the page."""
