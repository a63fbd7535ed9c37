"""The report of a diagnosis as frozen records: what it says, how it becomes JSON and is read back, its JSON schema."""
