"""The rows that a worker computes, apart from what writes them: workers need not load the package of tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

Columns = Mapping[str, Sequence[Any]]


class Batch(NamedTuple):
    """The rows of one task, by its number."""

    number: int
    columns: Columns
