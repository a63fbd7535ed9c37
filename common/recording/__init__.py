"""Recordings: MCAP files with protobuf messages and their schemas inside; the only package that imports that library.

Everything is derived from the table in `signals.py`. A file is readable up to its last flush, finished or not.
"""
