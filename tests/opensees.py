"""Whether OpenSees is available here for comparisons."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache

from common.opensees.process import INTERPRETER


@cache
def lacking() -> str:
    """Why tests with OpenSees are skipped, empty where they run."""
    words = [os.environ.get(INTERPRETER) or sys.executable, "-c", "import openseespy.opensees"]
    done = subprocess.run(words, capture_output=True, check=False)
    if not done.returncode:
        return ""
    said = done.stderr.decode(errors="replace").strip().splitlines()
    return f"OpenSeesPy does not load here ({said[-1] if said else 'no word'}): make opensees"
