"""The exchange of a recorded test: how old messages were when they were used, which never came, and the effects."""
