"""The services of docker-compose.yml, where there is an engine."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from tests.helpers import ROOT
from tests.processes import HANG_S, finished

pytestmark = pytest.mark.slow

SKIPPED = 77


@pytest.mark.timeout(960)
def test_the_services_write_a_complete_recording() -> None:
    if (
        shutil.which("docker") is None
        or subprocess.run(["docker", "info"], capture_output=True, timeout=HANG_S).returncode != 0
    ):
        pytest.skip("no container engine runs here: see tests/system/compose_check.sh --start-engine")
    check = finished(ROOT / "tests" / "system" / "compose_check.sh", seconds=900.0)
    if check.returncode == SKIPPED:
        pytest.skip(check.stdout.strip().splitlines()[-1])
    assert check.returncode == 0, check.stdout + check.stderr
