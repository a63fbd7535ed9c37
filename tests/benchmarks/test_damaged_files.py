"""What is recovered of damaged files, beside the MCAP library and its project's command."""

from __future__ import annotations

from pathlib import Path

from benchmarks.damaged_files import DAMAGES, WAYS, compare

# what leaves the lengths of the records whole, so that one can go from record to record
FRAMES_WHOLE = ("none", "cut off after two thirds", "footer missing", "a bit in a chunk")


def test_no_other_way_recovers_more_and_where_the_frames_are_gone_all_recover_less(tmp_path: Path) -> None:
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
