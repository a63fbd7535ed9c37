"""The message about the keys in which two plans differ."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from common.plan import plan_difference as difference
from common.plan import read as plans
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.plan.read import parse
from common.protocol import codec
from common.protocol.messages import Recorder, Register
from common.terminal import cli

ONE = parse("[test]\nduration = 5.0\n", Path())
OTHER = parse(
    "[test]\nduration = 5.0\nseed = 3\n[structure]\nmass = [1e5, 1e5]\nstiffness = 25e6\n".replace(
        "stiffness = 25e6", "stiffness = [25e6, 25e6]\ndamping = [2e5, 2e5]"
    ),
    Path(),
)


def told(mine: Plan, theirs: Plan) -> str:
    return difference.differences(mine, difference.said(theirs), "slave", "master")


def test_the_keys_that_differ_are_named_with_both_values() -> None:
    assert told(ONE, Plan()) == "in test.duration (master 40.0, slave 5.0)"
    text = told(ONE, OTHER)
    assert "structure.mass (master [100000.0, 100000.0], slave 160000.0)" in text
    assert "test.seed (master 3, slave 1)" in text
    assert "duration" not in text


def test_another_version_of_the_package_is_named_first(monkeypatch: Any) -> None:
    heard = difference.said(OTHER)
    monkeypatch.setattr("common.plan.plan_difference.metadata.version", lambda _name: "9.9")
    assert difference.differences(ONE, heard, "slave", "master").startswith("in rths (master ")


def test_many_differences_between_plans_are_counted_and_not_listed() -> None:
    limits = "".join(
        f"{name} = 0.01\n" for name in ("displacement", "velocity", "column_force", "table_step")
    )
    many = parse(
        f"[limits]\n{limits}[sensors]\ncolumn_force = 1\ndamper_force = 1\ndamper_stroke = 1\n[test]\nseed = 9\n",
        Path(),
    )
    assert told(ONE, many).endswith(" and 2 more")


@pytest.mark.parametrize("name", cli.SHIPPED)
def test_the_announced_plan_fits_into_a_message(name: str) -> None:
    plan = plans.load(cli.plan_path(name))
    text = difference.said(plan)
    assert difference.digest_of(text) == plan.digest()
    assert json.loads(text.partition(" ")[2])
    for message in (Register(0, PROTOCOL_VERSION, text), Recorder(0, "ready", text, "", b"")):
        frame = codec.encode(message, codec.session_key(0, ""))
        assert codec.decode(frame, codec.session_key(0, "")) == message


def test_values_that_do_not_fit_a_message_are_announced_as_digests(monkeypatch: Any) -> None:
    monkeypatch.setattr(difference, "MOST_TEXT", len(difference.said(OTHER)) - 1)
    assert told(ONE, OTHER).startswith("in structure.damping (master #")
    assert "duration" not in told(ONE, OTHER)
    monkeypatch.setattr(difference, "MOST_TEXT", 20)
    assert told(ONE, OTHER) == f"(master {OTHER.digest()}, slave {ONE.digest()})"


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    some.one_of(
        some.text(max_size=300),
        some.dictionaries(some.text(max_size=90), some.text(max_size=90), max_size=9).map(
            lambda found: f"0123456789abcdef {json.dumps(found, ensure_ascii=False)}"
        ),
        some.just("0123456789abcdef " + "[" * 3000),
        some.just('0123456789abcdef {"a": 1}'),
    )
)
def test_a_hostile_plan_announcement_is_shown_printable_and_short(heard: str) -> None:
    text = difference.differences(ONE, heard, "slave", "master")
    assert text.isprintable()
    assert len(text) < 1000
