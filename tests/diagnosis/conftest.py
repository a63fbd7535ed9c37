"""Recordings that the diagnosis is tried on."""

from __future__ import annotations

import pytest

from tests.diagnosis.cases import Cases


@pytest.fixture(scope="session")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand."""
    return Cases(tmp_path_factory)
