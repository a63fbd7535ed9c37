"""Fixtures of the fault matrix."""

from __future__ import annotations

import pytest

from tests.faults.simulated import Course, Scene


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Course:
    """The test in which nothing goes wrong."""
    course = Scene(tmp_path_factory.mktemp("undisturbed")).play()
    course.calm()
    return course
