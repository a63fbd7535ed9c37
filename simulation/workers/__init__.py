"""Work on many items, spread over processes or over the machines of a Dask cluster, and the table of its results."""
