"""What a data logger does to a signal before it stands in a file."""
