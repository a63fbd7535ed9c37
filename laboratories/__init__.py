"""Kinds of laboratory, each described in a folder of its own, with their effects, limits and identification."""
