"""What a sensor adds to a reading: noise of a colour, lines, spikes, and the steps of its resolution."""
