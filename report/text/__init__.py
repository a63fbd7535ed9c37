"""Text for a terminal and for tables: numbers with units, tables, progress, files of other programs."""
