"""What a test is: the plan and the reality as files, their tables and keys, what is checked of them, what differs."""
