"""The account of messages, sent = used + rejected + lost, holds whatever strangers send."""

from __future__ import annotations

from pathlib import Path

from hypothesis import example, given
from hypothesis import strategies as st

from common import signals
from common.protocol.tally import AHEAD, REPEATED, Tally
from common.recording.reader import read
from common.recording.writer import Recording
from report.facts.accounts import account, accounts
from report.text.formats import apart

TICKS, WINDOW = 60, 20
NUMBERS = st.integers(0, 10_000)


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS, NUMBERS)
@example(531, 503, 111, 0, 0)
def test_the_account_of_messages_adds_up_for_any_counts(
    sent: int, used: int, rejected: int, beyond: int, extra: int
) -> None:
    found = account(sent, used, rejected, beyond, extra)
    assert found.sent == sent == found.used + found.rejected + found.lost
    assert min(found) >= 0
    assert used + rejected + extra == found.used + found.rejected + found.foreign


@given(
    sent=st.integers(1, TICKS),
    missed=st.sets(st.integers(0, TICKS - 1), max_size=5),
    dropped=st.sets(st.integers(0, TICKS - 1), max_size=10),
    late=st.dictionaries(st.integers(0, TICKS - 1), st.integers(1, 40), max_size=10),
    injected=st.lists(st.tuples(st.integers(0, TICKS + 30), st.integers(-2, TICKS + 60)), max_size=40),
)
def test_the_account_adds_up_over_a_link_with_loss_delay_and_strangers(
    sent: int,
    missed: set[int],
    dropped: set[int],
    late: dict[int, int],
    injected: list[tuple[int, int]],
) -> None:
    """Without strangers it is exact; with them no more are called foreign than they sent, and none is lost twice."""
    own = [seq for seq in range(sent) if seq not in missed]
    frames = [(seq + late.get(seq, 0), 1, seq) for seq in own if seq not in dropped]
    frames += [(at, 0, seq) for at, seq in injected]
    tally, used = Tally(TICKS, WINDOW), set()
    for at, _, seq in sorted(frames):
        if tally.admit(seq, at) and at - seq < 3:
            tally.use(seq)
            used.add(seq)
    extra = tally.reasons[AHEAD] + tally.reasons[REPEATED]
    beyond = sum(seq >= sent for seq in used)
    found = account(len(own), tally.used, tally.rejected, beyond, extra)
    assert found.used + found.rejected + found.lost == len(own)
    assert 0 <= found.foreign <= len(injected)
    assert found.lost <= len(dropped & set(own))
    if not injected:
        assert (found.foreign, found.lost) == (0, len(dropped & set(own)))


def test_injected_commands_are_counted_separately(tmp_path: Path) -> None:
    """531 commands were sent; a stranger's 3 under higher numbers came into force, 2 came twice, 1 far ahead."""
    path, sent = tmp_path / "a.mcap", 531
    recording = Recording(path, "trial", 1, signals.TOPICS)
    for seq in range(sent + 3):
        if seq < sent:
            recording.add("master", seq, seq, filled("master", seq=seq))
        recording.add("slave", seq, seq, filled("slave", seq=seq, command_seq=seq))
    told = {"commands.used": 506.0, "commands.rejected": 111.0}
    told |= {"commands.turned_away.repeated": 2.0, "commands.turned_away.ahead": 1.0}
    for lab, values in (("master", {"slave.commands_sent": float(sent)}), ("slave", told)):
        recording.add("event", 0, 0, (0.0, lab, "info", "exchange", "told", values))
    recording.close({})
    counts = accounts(read(path))["slave/commands"]
    assert counts == {"sent": 531, "used": 503, "rejected": 28, "lost": 0, "foreign": 3 + 83 + 3}
    assert apart(counts) == "; at least 89 more arrived that it did not send"
    assert apart(counts | {"foreign": 0}) == ""


def filled(topic: str, **values: int) -> list[float | int | bool]:
    """A row of a topic with zeros where nothing is given."""
    return [values.get(row.name, 0) for row in signals.TOPICS[topic]]


def test_a_message_numbered_ahead_of_time_is_not_counted_as_used_or_rejected() -> None:
    tally = Tally(TICKS, WINDOW)
    assert not tally.admit(50, 5)
    assert (tally.used, tally.rejected, tally.reasons[AHEAD]) == (0, 0, 1)


def test_a_link_without_impairments_rejects_nothing_in_virtual_time(virtual_recording: Path) -> None:
    found = accounts(read(virtual_recording))
    assert {name: (counts["rejected"], counts["lost"]) for name, counts in found.items()} == {
        "slave/commands": (0, 0),
        "slave/feedbacks": (0, 0),
    }
