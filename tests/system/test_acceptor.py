"""The threads in which a session of the link takes connections."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers import ROOT
from tests.processes import HANG_S, environment

THREADS = """
import zenoh
from pathlib import Path
from common.link.zenoh_link import configuration, listenable

with zenoh.open(configuration("master", listenable(), "")):
    names = [one.read_text().strip() for one in Path("/proc/self/task").glob("*/comm")]
print(*sorted(name for name in names if name.startswith("acc-")))
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="this system does not list its threads")
def test_connections_are_accepted_in_two_threads_so_that_a_slow_close_delays_none() -> None:
    done = subprocess.run(
        [sys.executable, "-c", THREADS],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        cwd=ROOT,
        env=environment(),
        check=False,
    )
    assert (done.stdout.split(), done.stderr) == (["acc-0", "acc-1"], "")
