"""The protocol between the processes of a test: messages, their bytes, and the states that they agree on."""
