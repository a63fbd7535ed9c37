"""What every command shares: options, errors as one sentence, files that it writes, safe text."""
