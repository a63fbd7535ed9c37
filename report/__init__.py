"""Everything that people read or look at: figures of a recording, tables, pictures, pages, the live view."""
