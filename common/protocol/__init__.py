"""What the processes of a test say to one another: roles, messages, their bytes, and the states they agree on."""
