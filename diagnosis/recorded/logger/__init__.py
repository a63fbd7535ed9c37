"""What a data logger makes of the readings of a laboratory, at the ticks and between them."""
