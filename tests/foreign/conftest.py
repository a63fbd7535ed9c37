"""Fixtures of the tests of buildings that another program computes."""

from tests.rths.conftest import call

__all__ = ["call"]
