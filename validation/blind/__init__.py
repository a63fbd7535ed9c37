"""The blind trial: cases whose effect is withheld, diagnosed by a process that sees recordings only, and scored."""
