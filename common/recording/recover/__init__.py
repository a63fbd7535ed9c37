"""The intact part of a damaged recording: which pieces of the file can be read, and a new file made of them."""
