"""Fragility curves for their reader: the tests of a sweep's table, tables, pictures, one page."""
