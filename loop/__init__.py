"""The simulated closed loop of building, laboratories and exchange, and the analysis of a plan by nominal models."""
