"""Words that every part of a distributed hybrid test shares: units, plan, messages, exchange, recording."""
