"""Recordings: MCAP files with protobuf messages and their schemas; the only package that imports the MCAP library.

All schemas derive from the table in `signals.py`. A file is readable up to its last flush, finished or not.
"""
