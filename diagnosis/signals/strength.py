"""How strong evidence must be."""

BEYOND = 10.0  # of −2·log, from which on evidence is called very strong (Kass and Raftery, 1995)
