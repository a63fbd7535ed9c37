"""What the laboratories really do, as files: realities, what a diagnosis found, and how sure it is of that."""
