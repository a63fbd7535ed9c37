"""NamedTuples that are created without their constructor."""

from __future__ import annotations

from common.named import maker
from common.protocol.messages import Command


def test_the_fast_constructor_gives_the_named_tuple_itself() -> None:
    wanted = Command(1, 2, 3, 4, 5, 0.1, 0.2, 0.3, 0.4, 0.5)
    made = maker(Command)(tuple(wanted))
    assert type(made) is Command
    assert made == wanted
    assert made.seq == 2
