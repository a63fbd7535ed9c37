"""The description of a plan that processes exchange at the handshake, and the keys in which two plans differ.

The text is the plan's digest, a blank, and as JSON every key that is not at its default, with the package's version.
It must not exceed the length of a message's text: where it would, each value is replaced by four hex digits, and where
that is not enough the digest stands alone. Text that comes over the network is not trusted: it is only compared and
shown, clipped.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from importlib import metadata
from typing import Any

from common.plan.patience import strict
from common.plan.plan import UNTESTED, Plan
from common.protocol.codec import MOST_TEXT

MOST_KEYS = 6  # named in one sentence, which then takes about five lines of a terminal
MOST_SHOWN = 40  # characters of a name or a value in a sentence: most keys of a plan are shorter
VERSION = "rths"  # beside the keys, which all hold a point
HASHED = "#"  # before the digits of a value that did not fit


def said(plan: Plan) -> str:
    """The text by which a process describes its plan to another."""
    digest, values = plan.digest(), changed(plan)
    for content in (values, {name: hashed(text) for name, text in values.items()}):
        text = f"{digest} {json.dumps(content, separators=(',', ':'))}"
        if len(text) <= MOST_TEXT:
            return text
    return digest


def digest_of(text: str) -> str:
    """The digest in a description of a plan."""
    return text.partition(" ")[0]


def changed(plan: Plan) -> dict[str, str]:
    """Every key that is not at its default, by its dotted name, as JSON; and the version of the package.

    Figures that follow from whether a rig is named are left out, because no plan sets them.
    """
    defaults, own = (dict(leaves(strict(one).tables())) for one in (Plan(), plan))
    given = {name: text for name, text in own.items() if defaults.get(name) != text}
    given |= dict.fromkeys(defaults.keys() - own.keys(), "null")
    return {VERSION: metadata.version("rths")} | {
        name: text for name, text in given.items() if name.partition(".")[0] not in UNTESTED
    }


def leaves(tables: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """The values of nested tables as JSON, by their dotted names."""
    for name, value in tables.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", json.dumps(value, sort_keys=True)


def hashed(text: str) -> str:
    """A value as four hex digits."""
    return HASHED + hashlib.blake2b(text.encode(), digest_size=2).hexdigest()


def differences(plan: Plan, heard: str, me: str, other: str) -> str:
    """How the plan described by `heard` differs from this one, in words; `me` and `other` are the two roles."""
    theirs = understood(heard)
    if theirs is None:
        return f"({other} {shown(digest_of(heard))}, {me} {plan.digest()})"
    mine, defaults = changed(plan), dict(leaves(Plan().tables()))
    pairs = []
    for name in sorted(mine.keys() | theirs.keys(), key=lambda name: (name != VERSION, name)):
        own, foreign = (one.get(name, defaults.get(name, "null")) for one in (mine, theirs))
        if foreign not in (own, hashed(own)):
            pairs.append(f"{shown(name)} ({other} {shown(foreign)}, {me} {shown(own)})")
    if not pairs:
        return f"in the order of their slaves or in defaults ({other} {shown(digest_of(heard))}, {me} {plan.digest()})"
    more = f" and {len(pairs) - MOST_KEYS} more" if len(pairs) > MOST_KEYS else ""
    return f"in {', '.join(pairs[:MOST_KEYS])}{more}"


def understood(heard: str) -> dict[str, str] | None:
    """The keys in another process's description of its plan; None where the text is not valid."""
    try:
        found = json.loads(heard.partition(" ")[2])
    except (ValueError, RecursionError):
        return None
    texts = isinstance(found, dict) and all(isinstance(value, str) for value in found.values())
    return found if texts else None


def shown(text: str) -> str:
    """Text of another process, clipped and made printable for a sentence."""
    clipped = text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 1]}…"
    return "".join(letter if letter.isprintable() else "?" for letter in clipped)
