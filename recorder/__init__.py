"""The recorder: a process that writes every sample of all laboratories to one MCAP file."""
