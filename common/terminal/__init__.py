"""What every command shares: options, errors as one sentence, output files, text that is safe for a terminal."""
