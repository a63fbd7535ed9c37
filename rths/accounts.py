"""What became of every message between the laboratories: sent = used + rejected + lost, by direction."""

from __future__ import annotations

from common.recording.reader import Run
from common.roles import MASTER


def accounts(run: Run) -> dict[str, dict[str, int]]:
    """By `<slave's role>/<direction>`: messages sent, used, rejected (too late, overtaken or not fresh) and lost.

    Each end counts what it sent and what came of what it received; lost is what was sent and never came. A direction of
    which an end has not told its count, because it was killed or cut off, is absent.
    """
    told: dict[str, dict[str, float]] = {}  # by laboratory; the master tells of each slave apart
    for event in run.events:
        if event["code"] == "exchange":
            told.setdefault(event["lab"], {}).update(event["values"])
    found = {}
    for role in run.roles:
        master, slave = told.get(MASTER, {}), told.get(role, {})
        ends = {
            "commands": (master.get(f"{role}.commands_sent"), slave, "commands"),
            "feedbacks": (slave.get("feedbacks_sent"), master, f"{role}.feedbacks"),
        }
        for direction, (sent, receiver, prefix) in ends.items():
            if sent is not None and f"{prefix}.used" in receiver:
                used, rejected = int(receiver[f"{prefix}.used"]), int(receiver[f"{prefix}.rejected"])
                found[f"{role}/{direction}"] = {
                    "sent": int(sent),
                    "used": used,
                    "rejected": rejected,
                    "lost": int(sent) - used - rejected,
                }
    return found
