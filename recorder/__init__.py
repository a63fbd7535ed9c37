"""The recorder: its own process, which writes every sample of both laboratories to one MCAP file."""
