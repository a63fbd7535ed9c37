"""The protocol between the processes of a test: messages, their encoding, and the states of a test."""
