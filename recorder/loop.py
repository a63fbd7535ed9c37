"""The recorder's loop.

It takes all streams in order, asks again for missing items, and reports those that never came.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from common import signals
from common.errors import IncompleteError, InputError, InterlockError, LostError
from common.host.clock import Clock
from common.lab.laboratory import REPEAT_NS, SLOW_RIG, Setting
from common.lab.outlet import BURST, PIECE, Inlet, pack_nexts
from common.lab.surroundings import CODES, described
from common.link.endpoint import Endpoint
from common.plan import patience
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.plan.plan_difference import differences, digest_of, said
from common.protocol.messages import Extend, Finished, Message, Recorder, Register, Resend, Samples
from common.recording.rows import HEAD, Item, layout, named_values, other
from common.reporting import Report
from common.roles import MASTER, RECORDER, kind_of, latency_topic, title
from laboratories import kinds
from recorder.items import Items
from recorder.sink import Sink

# silence after which a test is over: its laboratories repeat their closing messages for that time (LEAVE_NS)
SILENCE_NS = 5_000_000_000
# Bounds on a stream's number of items: two topics per tick and as much again, and events for so many ticks.
ITEMS_PER_TICK, SPARE_TICKS = 4, 100_000
ASK_NS = 20_000_000  # between two requests to a laboratory that has answered: ten intervals, in which it sends `BURST`
ASKED_SILENCE_NS = (
    2_000_000_000  # as SILENCE_NS after a request to stop: moving laboratories are heard every interval
)
ASKED_NS = (
    20_000_000_000  # it records for so long after a request to stop: longer than a ramp at the default limits
)
STALL_NS = 1_000_000_000  # a longer pause of this process is its own, and extends all deadlines: 0.5 s are usual ones
ROWS_LOST = "rows_lost"  # code of the event for items that a laboratory did not send again
MISSED = ("watchdog", "lost")  # codes with which a laboratory ends because it missed another
CONSEQUENCE = "remote_trip"  # code of an end that follows from another laboratory's, whose cause counts
# offset of the flag of a missed deadline in a row of latency, after the numbers of the signals before it
MISSED_AT = layout(signals.LATENCY[: [row.name for row in signals.LATENCY].index("deadline_missed")], 1).size


class StreamHole(NamedTuple):
    """A gap in a stream: its first missing item, since when it is the first, and when it was requested (ns)."""

    first: int
    since_ns: int
    asked_ns: int


class RecorderLoop:
    """Receives the streams of one test and hands their items to a sink."""

    def __init__(self, setting: Setting, sink: Sink) -> None:
        self._plan: Plan = setting.plan
        self._endpoint: Endpoint = setting.endpoint
        self._clock: Clock = setting.clock
        self._report: Report = setting.report
        self._sink = sink
        self._digest, self._said = setting.plan.digest(), said(setting.plan)
        labs = (MASTER, *setting.plan.roles)
        self._ticks = setting.plan.ticks  # of the test; more where it is held
        self._items = {lab: Items(setting.plan, lab) for lab in labs}
        self._inlets = {lab: Inlet(items.unpack, self._most_items) for lab, items in self._items.items()}
        self._holes: dict[str, StreamHole] = {}
        self._session = 0
        self._said_ns = -REPEAT_NS
        self._heard_ns = self._polled_ns = setting.clock.now()
        self._stalled_ns = 0
        self._filled_ns = -ASK_NS
        self._seen = {
            topic: bytearray(setting.plan.ticks)
            for topic in kinds.topics(setting.plan)
            if kind_of(topic) in signals.TICK_TOPICS
        }
        self._latencies = frozenset(map(latency_topic, setting.plan.roles))
        self._missed = 0
        self._machines: dict[str, str] = {}  # metadata of the recording
        self._outcome = ("", "")
        self._said_failure = False
        self._unended: list[str] = []  # laboratories the end of whose stream never came
        self._settled = False  # whether the test had ended when the recorder was stopped
        self._begun = False  # whether a tick has been received
        self._newest_ns = self._newest_tick = 0  # log time and number of the newest tick
        self._wish = ""  # why it was asked to stop
        self._asked_ns = 0
        self.error: IncompleteError | InputError | InterlockError | LostError | None = None
        self.done = False

    @property
    def _most_items(self) -> int:
        """Largest number of items of a laboratory's stream."""
        return ITEMS_PER_TICK * len(self._items) * (self._ticks + SPARE_TICKS)

    # -- messages ---------------------------------------------------------------------------------

    def take(self, message: Message, received_ns: int) -> None:
        """Act on one message of a laboratory."""
        if isinstance(message, Register):
            self._register(message)
        if not self._session or message.session != self._session:
            return
        self._heard_ns = received_ns
        match message:
            case Samples() if message.lab in self._inlets:
                self._write(self._inlets[message.lab].take(message))
            case Finished() if message.lab in self._inlets:
                self._inlets[message.lab].end(message)
            case Extend():
                self._extend(message.ticks)
            case _:
                pass

    def _extend(self, ticks: int) -> None:
        """Take note that holds have made the test longer, by no more ticks than have been recorded and a ramp has."""
        if not self._ticks <= ticks <= 2 * self._plan.ticks + self._newest_tick + SPARE_TICKS:
            return
        more, self._ticks = ticks - self._ticks, ticks
        for lab, inlet in self._inlets.items():
            inlet.most, self._items[lab].ticks = self._most_items, ticks
        for seen in self._seen.values():
            seen.extend(bytes(more))

    def _register(self, request: Register) -> None:
        if self._session:
            return
        if complaint := self._complaint(request):
            self.error = InputError(complaint)
            self._say()
            self.done = True
            return
        self._session = request.session
        self._endpoint.enter(request.session)
        self._said_ns = -REPEAT_NS

    def _complaint(self, request: Register) -> str:
        """Why the recorder cannot take part, empty where it can."""
        if request.protocol != PROTOCOL_VERSION:
            versions = f"{request.protocol}, the recorder {PROTOCOL_VERSION}"
            return f"The master speaks protocol {versions}: install one version."
        if digest_of(request.plan) != self._digest:
            difference = differences(self._plan, request.plan, "recorder", "master")
            return f"The plans differ {difference}: give all the same file and options."
        return ""

    def _write(self, items: list[Item]) -> None:
        seen_of, head, latencies, newest = (
            self._seen.get,
            HEAD.unpack_from,
            self._latencies,
            self._newest_tick,
        )
        for topic, row in items:
            if (seen := seen_of(topic)) is not None:
                log_ns, _, tick = head(row)
                if tick > newest:
                    newest = self._newest_tick = tick
                    self._begun, self._newest_ns = True, log_ns
                seen[tick] = 1  # one byte each, so that memory does not grow with the test
                if topic in latencies:
                    self._missed += row[MISSED_AT]
            elif topic == "event":
                self._take_event(named_values(signals.EVENT, row))
        if items:
            self._sink.put(items)

    def _take_event(self, event: Mapping[str, Any]) -> None:
        """Keep an event's facts on the machines and on the test's end, of which the earliest cause counts."""
        level, code, text = event["level"], event["code"], event["text"]
        if code in CODES:
            self._machines |= described(event["lab"], code, event["values"])
        settled = self._outcome[0] not in ("", CONSEQUENCE)
        if code == SLOW_RIG and self._outcome[0] in MISSED:  # the slow rig caused the silence
            settled = False
        if (
            (level == "error" or code == "stop")
            and not settled
            and (code != CONSEQUENCE or not self._outcome[0])
        ):
            self._outcome = (code, text)

    # -- housekeeping -----------------------------------------------------------------------------

    def poll(self) -> None:
        """Report the progress, request missing items, and end when all items are there or every laboratory has left."""
        now = self._clock.now()
        self._notice_stall(now)
        if self._session and now - self._filled_ns >= ASK_NS:
            self._filled_ns = now
            self._fill_holes(now)
        if now - self._said_ns >= REPEAT_NS:
            self._said_ns = now
            self._say()
        self._end(now)

    def _notice_stall(self, now: int) -> None:
        """Extend the laboratories' deadlines by the time for which this process was held up."""
        held = now - self._polled_ns
        self._polled_ns = now
        if held > STALL_NS:
            self._stalled_ns += held
            self._heard_ns = now
            self._holes = {
                lab: hole._replace(since_ns=hole.since_ns + held) for lab, hole in self._holes.items()
            }

    def _say(self) -> None:
        failure = self._sink.failure or (str(self.error) if self.error else "")
        state = (
            "failed" if failure else "stopping" if self._wish else "recording" if self._session else "ready"
        )
        if failure and not self._said_failure:
            self._said_failure = True
            refused = isinstance(self.error, InputError)
            code = "recording_lost" if self._sink.failure else "refused" if refused else "lost"
            self._report("event", {"lab": RECORDER, "level": "error", "code": code, "text": failure})
        nexts = pack_nexts({lab: inlet.next for lab, inlet in self._inlets.items()})
        self._endpoint.send(Recorder(self._session, state, self._said, failure or self._wish, nexts))

    def _fill_holes(self, now: int) -> None:
        patience_ns = self._plan.recording.patience * 1e9
        for lab, inlet in self._inlets.items():
            missing, hole = inlet.missing(), self._holes.get(lab)
            if missing is None:
                self._holes.pop(lab, None)
            elif hole is not None and hole.first == missing[0] and now - hole.since_ns > patience_ns:
                del self._holes[lab]
                self._give_up(lab)
            else:
                self._ask(lab, missing[0], hole, now)

    def _give_up(self, lab: str) -> None:
        """Count the first hole of a stream as lost, report it, and go on after it."""
        inlet = self._inlets[lab]
        before = inlet.lost
        items = inlet.give_up()
        self._say_lost(
            f"{inlet.lost - before} rows and events of the {title(lab)} are lost: they did not reach the recorder, and "
            "were not sent again in time.",
            {"items": float(inlet.lost - before)},
        )
        self._write(items)

    def _give_up_rest(self) -> None:
        """Write the items after holes that are still open, and report the streams whose end is missing.

        A laboratory that has sent nothing when no tick was played has taken no part in the test.
        """
        for lab, inlet in self._inlets.items():
            while inlet.missing() is not None:
                self._give_up(lab)
            if self._session and inlet.total is None and (self._begun or inlet.begun):
                self._unended.append(lab)
                self._say_lost(f"The end of the stream of the {title(lab)} did not reach the recorder.", {})

    def _say_lost(self, text: str, values: Mapping[str, float]) -> None:
        """Record and report a loss of items, at the time of the newest tick."""
        log_ns, t = self._newest_ns, self._newest_tick * self._plan.test.interval
        event = (log_ns, log_ns, t, RECORDER, "error", ROWS_LOST, text, dict(values))
        self._sink.put([other("event", event)])
        said = {"t": t, "lab": RECORDER, "level": "error", "code": ROWS_LOST, "text": text}
        self._report("event", said | dict(values))

    def _ask(self, lab: str, first: int, hole: StreamHole | None, now: int) -> None:
        """Request the first missing items, again at once where the last answer has come."""
        moved = hole is None or hole.first != first
        if hole is not None and now - hole.asked_ns < (ASK_NS if moved else REPEAT_NS):
            return
        self._holes[lab] = StreamHole(first, now if hole is None or moved else hole.since_ns, now)
        left = BURST * PIECE  # a laboratory sends again no more at once, because it does so between its ticks
        for begin, end in self._inlets[lab].holes():
            last = min(end, begin + left - 1)
            self._endpoint.send(Resend(self._session, lab, begin, last))
            left -= last + 1 - begin
            if left <= 0:
                break

    def _end(self, now: int) -> None:
        silent = now - self._heard_ns
        patience = ASKED_SILENCE_NS if self._wish else self._silence_ns
        if self._complete:
            self.error = InterlockError(self._wish) if self._wish else self.error
            self.done = True
        elif self._wish and now - self._asked_ns > ASKED_NS:
            self._leave(self._wish)
        elif not self._session and silent > self._plan.link.connect_timeout * 1e9:
            seconds = self._plan.link.connect_timeout
            self.error = LostError(
                f"No master was heard within {seconds:g} s: check the address after --connect."
            )
            self.done = True
        elif self._session and silent > patience:
            self._fell_silent()
            self.done = True

    @property
    def _complete(self) -> bool:
        """Whether every stream has ended and all its items were handed on."""
        for inlet in self._inlets.values():  # noqa: SIM110 - a generator for `all` takes twice as long
            if not inlet.complete:
                return False
        return True

    @property
    def _silence_ns(self) -> int:
        """Silence after which a test is over; before the first tick it is longer, because a rig may be arming."""
        return SILENCE_NS if self._begun else max(SILENCE_NS, round(self._plan.link.connect_timeout * 1e9))

    def _fell_silent(self) -> None:
        """End the recording because no laboratory is heard; without an orderly end of all of them the test is lost."""
        code, text = self._outcome
        missing = [title(lab) for lab, inlet in self._inlets.items() if inlet.total is None]
        if code == "stop" and missing:
            who = " and ".join(missing)
            self._outcome = (
                "lost",
                f"The {who} fell silent before the rig was known to be at rest, after: {text}",
            )
        elif not code:
            self._outcome = ("lost", "The laboratories fell silent.")
        if self._outcome[0] == "lost" and self._outcome[0] != code:
            self.error = LostError(f"{self._outcome[1].removesuffix('.')}; the recording ends there.")

    def stop(self, reason: str) -> None:
        """End the recording on request; if the test has ended before, its own cause stays the outcome.

        A test that requires its recording is asked to end, and its ramp to rest is recorded.
        """
        if self._wish or self.done:
            return
        if self._session and self._plan.recording.required and not self._sink.failure:
            self._wish, self._asked_ns = reason, self._clock.now()
            self._say()
        else:
            self._leave(reason)

    def _leave(self, reason: str) -> None:
        """Stop recording, even though the test may go on."""
        self.error = LostError(reason)
        self._settled = bool(self._outcome[0])
        if not self._settled:
            self._outcome = ("stop", reason)
        self._say()
        self.done = True

    def close(self) -> Mapping[str, str]:
        """Send the last state, write the summary and close the file.

        Returns the summary, and sets `error` for losses.
        """
        self._give_up_rest()
        self._judge()
        self._say()
        summary = self.summary()
        self._sink.close(summary, self._machines)
        if self._sink.failure:
            self.error = LostError(
                f"The recording is incomplete: {self._sink.failure} The file holds all data before that."
            )
        return summary

    def _judge(self) -> None:
        """Set the error of a required recording with losses, unless another error counts more."""
        lost = sum(inlet.lost for inlet in self._inlets.values())
        worse = self.error is not None and not self._settled
        if not self._plan.recording.required or worse or not (lost or self._unended):
            return
        ends = " and ".join(title(lab) for lab in self._unended)
        missing = [f"{lost} rows and events"] * bool(lost) + [f"the end of {ends}"] * bool(ends)
        self.error = IncompleteError(
            f"The test is over, but its recording lacks {' and '.join(missing)}: the recorder was held up or cut off, "
            "so free its processor and link (`rths doctor`) and repeat the test if they count."
        )

    def summary(self) -> dict[str, str]:
        """The summary: expected, recorded and missing items, and how the test ended."""
        result: dict[str, Any] = {"ticks_expected": self._ticks}
        for topic, seen in self._seen.items():
            result[f"{topic}_recorded"] = seen.count(1)
            result[f"{topic}_gaps"] = seen.count(0, 0, seen.rfind(1) + 1)
        result["items_lost"] = sum(inlet.lost for inlet in self._inlets.values())
        result["pieces_rejected"] = sum(inlet.rejected for inlet in self._inlets.values())
        result["items_dropped"] = self._sink.dropped
        result["items_waiting_most"] = self._sink.most_waiting
        result["recorder_stalled_s"] = f"{self._stalled_ns * 1e-9:.3f}"
        result["deadline_misses"] = self._missed
        if self._plan.eased:
            result["patience"] = patience.sentence(self._plan)
        result["outcome"], result["cause"] = self._outcome[0] or "unknown", self._outcome[1]
        return {name: str(value) for name, value in result.items()}
