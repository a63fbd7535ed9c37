"""How much is recovered from damaged files, compared with the MCAP library and its project's command."""

from __future__ import annotations

from pathlib import Path

from benchmarks.damaged_files import DAMAGES, WAYS, compare

# what leaves the lengths of the records whole, so that one can go from record to record
FRAMES_WHOLE = ("none", "cut off after two thirds", "footer missing", "a bit in a chunk")


def test_recovery_is_at_least_as_complete_as_other_tools_and_better_where_the_framing_is_lost(
    tmp_path: Path,
) -> None:
    shares = compare(tmp_path, ticks=600)
    assert list(shares) == list(DAMAGES)
    for name, (*others, ours) in shares.items():
        assert len(others) + 1 == len(WAYS)
        if name in FRAMES_WHOLE:
            assert ours == others[-1], name
        if name == "a bit in a chunk's length":  # which the index at the end knows too
            assert others[1] >= ours > others[-1]
        elif "bit" not in name and name not in FRAMES_WHOLE:
            assert ours > max(others), name
