"""A prediction for its reader: tables, pictures, one page."""
