"""What a page of the panel shows, as plain values; what can grow old has its age (s) at the moment of the answer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from common.host.clock import Clock
from common.roles import MASTER, RECORDER, name_of, title
from common.safety.modes import LATCHED, Mode
from report.live.feed import Feed
from report.live.levels import limits
from report.live.standing import GRAVEST
from report.panel.desk import Desk
from report.panel.snapshot import CheckResult, Shown, Snapshot
from report.panel.words import WORDS
from report.plan import text as plan_text
from report.text.formats import quantity

MOVING = frozenset(
    {Mode.RUNNING.value, Mode.HOLDING.value, Mode.RAMPING.value}
)  # a laboratory then records rows
LOUD = {
    Mode.HOLDING.value: "warn",
    Mode.RAMPING.value: "warn",
    Mode.SAFE.value: "bad",
    Mode.EMERGENCY_STOP.value: "bad",
}
GONE, LEFT, UNKNOWN = "no process", "left", "not known"
CAUSES = 4  # that are shown: one for each laboratory of a usual test


class PanelView:
    """Everything that a page shows; `clock` is that of the server."""

    def __init__(self, desk: Desk, clock: Clock) -> None:
        self._desk, self._clock = desk, clock

    def state(self, snapshot: Snapshot, feed: Feed, session: str) -> dict[str, Any]:
        """The state for one page."""
        shown = snapshot.shown
        labs = [self._lab(role, shown, feed) for role in (MASTER, *shown.plan.roles)] if shown else []
        return {
            "seen": self._clock.now() // 1_000_000,
            "page": self._desk.page(session),
            "test": self._test(shown, feed) if shown else None,
            "phase": phase(snapshot, labs, feed),
            "labs": labs,
            "recorder": self._recorder(shown) if shown else [],
            "recorded": feed.changes > 0,
            "causes": causes(snapshot, feed),
            "bars": list(bars(feed)),
            "plan": self._plan(snapshot),
            "machine": self._machine(snapshot.machine),
            "lines": list(shown.reports.lines if shown else ()),
            "orders": [self._order(entry, session) for entry in self._desk.newest],
        }

    def _seconds(self, at: int) -> float:
        """The age of what was at a time (ns), s."""
        return max(self._clock.now() - at, 0) * 1e-9

    def _test(self, shown: Shown, feed: Feed) -> dict[str, Any]:
        """The test that runs; a master that leaves after the recording's end has cut no link."""
        unlinked = shown.unlinked_at and not feed.finished
        return {
            "id": shown.test,
            "name": shown.name,
            "digest": shown.digest,
            "recording": str(shown.recording or ""),
            "own": shown.own,
            "linked": shown.linked,
            "unlinked": self._seconds(shown.unlinked_at) if unlinked else None,
            "t": feed.t,
            "duration": shown.plan.test.duration,
        }

    def _lab(self, role: str, shown: Shown, feed: Feed) -> dict[str, Any]:
        """The mode of a laboratory, by the newest that is known of it."""
        reports = shown.reports
        measured = feed.standing.age(role) if feed.standing.last(role) is not None else None
        mode, age, note = feed.standing.modes.get(role, UNKNOWN), measured, ""
        if role in reports.modes:
            mode, at = reports.modes[role]
            still = mode not in MOVING
            age = (
                self._seconds(reports.alive_at)
                if still
                else measured
                if measured is not None
                else self._seconds(at)
            )
            if role not in reports.alive and reports.alive_at > at:
                in_order = mode == Mode.IDLE.value  # as after every end in which its rig came to rest
                mode, note = LEFT if in_order else GONE, f"it was {mode.replace('_', ' ')}"
                age = self._seconds(reports.alive_at)
        elif shown.own:
            mode, age = "starting", self._seconds(reports.alive_at) if role in reports.alive else None
        if mode in {one.value for one in LATCHED}:
            note = "latched until Reset"
        words = mode.replace("_", " ")
        loud = "bad" if mode == GONE else LOUD.get(mode, "")
        return {"role": role, "title": title(role), "mode": words, "loud": loud, "age": age, "note": note}

    def _recorder(self, shown: Shown) -> list[dict[str, Any]]:
        """The recorder's process where this panel has started the test: one row, none before it is known."""
        alive = shown.reports.alive
        if not shown.reports.alive_at:
            return []
        mode = "recording" if RECORDER in alive else GONE if alive else LEFT
        row = {"role": RECORDER, "title": title(RECORDER), "mode": mode, "note": ""}
        return [row | {"loud": "bad" if mode == GONE else "", "age": self._seconds(shown.reports.alive_at)}]

    def _plan(self, snapshot: Snapshot) -> dict[str, Any]:
        """The plan that can be armed, as `rths check` describes it."""
        checked, found = snapshot.plan, snapshot.plan.found
        (_, text), *others = plan_text.named(found) if found else [("", "")]
        peaks = [
            {
                "name": name.replace("_", " "),
                "now": quantity(one["peak"], one["unit"]),
                "limit": quantity(one["limit"], one["unit"]),
                "share": one["share"],
            }
            for name, one in (found["peaks"].items() if found else ())
            if one["limit"] is not None
        ]
        return {
            "file": snapshot.file,
            "digest": found.get("digest", ""),
            "ready": bool(found.get("ready")),
            "facts": [("test", text), *others] if found else [],
            "peaks": peaks,
            "concerns": list(plan_text.concerns(found)) if found else [],
            **self._checked(checked),
        }

    def _machine(self, checked: CheckResult) -> dict[str, Any]:
        """What this machine lacks, as `rths doctor` says it."""
        found = checked.found
        failed: dict[str, list[str]] = {}
        for one in found.get("checks", ()):
            if not one["passed"]:
                failed.setdefault(one["advice"], []).append(one["name"])
        lacks = [f"{', '.join(names)}: {advice}" for advice, names in failed.items()]
        lacks += [*found["realtime"]["missing"], *found["notes"]] if found else []
        verdict = found["verdict"]["sentence"] if found else ""
        return {"lacks": lacks, "verdict": verdict, **self._checked(checked)}

    def _checked(self, checked: CheckResult) -> dict[str, Any]:
        age = self._seconds(checked.at) if checked.at else None
        return {"busy": checked.busy, "complaint": checked.complaint, "age": age}

    def _order(self, entry: Any, session: str) -> dict[str, Any]:
        own, outcome = entry.request.session == session, entry.outcome
        word = WORDS[entry.request.word].label if entry.request.word in WORDS else entry.request.word
        return {
            "number": entry.request.number if own else 0,
            "page": entry.page,
            "word": word,
            "state": outcome.state,
            "text": outcome.text,
            "age": self._seconds(entry.at),
        }


def phase(snapshot: Snapshot, labs: list[dict[str, Any]], feed: Feed) -> str:
    """The state of everything in a few words: that of the laboratory that is farthest from running."""
    if snapshot.shown is None:
        ended = f"ended: {snapshot.ending}" if snapshot.ending else feed.state if feed.ended else ""
        return f"No test runs. The last one {ended}" if ended else "No test runs"
    modes = {lab["mode"] for lab in labs}
    if GONE in modes or modes == {LEFT}:
        return "a laboratory has no process" if GONE in modes else "the laboratories have left"
    words = [mode.value.replace("_", " ") for mode in GRAVEST]
    found = next((word for word in words if word in modes), UNKNOWN if UNKNOWN in modes else "starting")
    return feed.standing.pace or found if found == Mode.RUNNING.value else found


def causes(snapshot: Snapshot, feed: Feed) -> list[dict[str, str]]:
    """What stopped the test: laboratory, test time and sentence of each cause."""
    found = [
        {"lab": title(one.lab), "t": f"t = {one.t:.2f} s", "text": one.text} for one in feed.standing.stops
    ]
    reported = snapshot.shown.reports.causes if snapshot.shown else snapshot.last
    return (found or [{"lab": title(lab), "t": "", "text": text} for lab, text in reported])[:CAUSES]


def bars(feed: Feed) -> Iterator[dict[str, Any]]:
    """The limits beside the measured values."""
    plan = feed.plan
    if plan is None or not feed.changes:
        return
    for lab in feed.laboratories:
        age = None if feed.ended else feed.standing.age(lab.topic)
        for name, limit in limits(plan, lab).items():
            level = feed.levels.of(lab.topic, name)
            if level is None:
                continue
            unit = feed.levels.units[lab.topic, name]
            where = f" of {name_of(lab.role)}" if name_of(lab.role) else lab.letter
            yield {
                "name": f"{name.replace('_', ' ')}{where}",
                "now": quantity(level.now, unit),
                "limit": quantity(limit, unit),
                "share": level.lately / limit if limit else 0.0,
                "most": level.most / limit if limit else 0.0,
                "age": age,
            }
