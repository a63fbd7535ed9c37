"""Other programs of this machine at a real-time priority: one that never sleeps delays a laboratory's loop."""

from __future__ import annotations

from pathlib import Path

PROC = Path("/proc")
RT_PRIORITY = 37  # place in /proc/PID/stat behind the name


def rivals() -> list[str]:
    """'fifo 49 python spin.py (process 1234)' for each process whose main thread has a real-time priority.

    The kernel's own threads are left out: they have no command line, and their priority is intended.
    """
    from common.host.machine import scheduler_name

    found = []
    for folder in PROC.glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
            priority = (folder / "stat").read_text().rsplit(")", 1)[1].split()[RT_PRIORITY]
        except (OSError, IndexError):
            continue  # ended meanwhile
        if words and priority != "0":
            found.append(f"{scheduler_name(int(folder.name))} {words[:60]} (process {folder.name})")
    return found
