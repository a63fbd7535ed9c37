"""Other programs that were tried with rths and whose versions stand in the lock files, for `reference/tried.md`."""

from __future__ import annotations

import re
from pathlib import Path

from docs.markdown import table

ROOT = Path(__file__).parent.parent
LOCKED = (
    (
        "opensees.lock",
        "openseespy",
        "`genericClient` of `rths serve` with NewmarkExplicit, CentralDifference, AlphaOS, and Newmark with Linear and "
        "Newton; one and two laboratories; static analysis and zeros before the motion",
    ),
    (
        "opensees.lock",
        "openseespy",
        "the building: the frame with fibre sections, virtual time and real time at 10 ms",
    ),
    (
        "opensees.lock",
        "openseespy",
        "specimens: Steel02 (0.02 ms per `write`) and the fibre column (0.44 ms in one step) in real time at 2 ms; "
        "Pinching4 in virtual time; the fibre column in four steps (1.6 ms) is too slow for 2 ms",
    ),
    (
        "fmi.lock",
        "fmpy",
        "its checker on both exported FMUs, their simulation; an FMU as rig, as specimen and as building",
    ),
    (
        "requirements.lock",
        "playwright",
        "the live page, the panel, the catalogue and the reports in Chromium, at 1280 and 390 pixels",
    ),
    ("requirements.lock", "mcap", "recordings written and read, also damaged ones"),
    ("requirements.lock", "pyarrow", "exported tables read back"),
)
"""Lock file, package and what was tried."""


def locked() -> str:
    """The table of packages with their versions; raises LookupError where a lock file has none."""
    rows = [(f"`{package}`", version(lock, package), text) for lock, package, text in LOCKED]
    return table(("package", "version", "what"), rows)


def version(lock: str, package: str) -> str:
    """The version of a package in a lock file; raises LookupError where it has none."""
    found = re.search(
        rf"^{re.escape(package)}==(\S+)", (ROOT / lock).read_text(encoding="utf-8"), re.MULTILINE
    )
    if found is None:
        raise LookupError(f"{lock} has no {package}")
    return found[1]
