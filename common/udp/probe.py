"""Check before a test whether the rigs in other processes answer, and how fast; nothing moves."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from typing import NamedTuple

from common.plan.plan import Plan
from common.safety.risks import Risk
from common.udp.account import quantile
from common.udp.peer import Peer
from common.udp.rig import Echoes, Terms, compared, echoes, unanswered


class Probed(NamedTuple):
    """The terms of the exchange with one rig, and the result of test exchanges."""

    terms: Terms
    channels: int  # the number of the plan's channels
    found: Echoes


def probe(terms: Terms, channels: int) -> Probed:
    """Exchange packets that move nothing with a rig; raises InputError if its address cannot be used."""
    peer = Peer(terms.address, terms.where)
    try:
        return Probed(terms, channels, echoes(peer, terms, secrets.randbits(32), channels))
    finally:
        peer.close()


def risk(probed: Probed, plan: Plan) -> Risk | None:
    """The risk of a rig that does not answer, has other channels or answers too late; None if there is none."""
    terms, found = probed.terms, probed.found
    if found.answer is None:
        return Risk("rig", unanswered(terms, found.faults))
    if complaint := compared(found.answer, probed.channels):
        return Risk("rig", f"of the rig at {terms.address} {complaint}")
    return slow(terms, found.round_trips_s, found.lost, plan)


def slow(terms: Terms, round_trips_s: Sequence[float], lost: int, plan: Plan) -> Risk | None:
    """The risk of a rig that loses answers, or in real time answers too late too often; None if there is none."""
    late = sum(trip > terms.wait for trip in round_trips_s) if terms.paced else 0
    most = plan.preflight.late_share * len(round_trips_s)
    if lost <= plan.preflight.lost and late <= most:
        return None
    return Risk(
        "rig",
        f"of {len(round_trips_s) + lost} exchanges with the rig at {terms.address} {lost} were lost and {late} took "
        f"longer than the {terms.wait * 1e3:g} ms that a tick waits ({plan.preflight.late_share:.0%} of them may), "
        f"{trips(round_trips_s)}, so quieten its program, its machine and the network, or raise answer_share in "
        f"{terms.where}",
    )


def text(terms: Terms, round_trips_s: Sequence[float]) -> str:
    """The result of a passed check as a sentence."""
    return f"Rig at {terms.address}: {len(round_trips_s)} exchanges, {trips(round_trips_s)}"


def trips(round_trips_s: Sequence[float]) -> str:
    """Median and 99th percentile of the round trips as text."""
    ranked = sorted(round_trips_s)
    p50, p99 = (quantile(ranked, part) * 1e3 for part in (0.5, 0.99))
    return f"round trip p50 {p50:.3f} ms, p99 {p99:.3f} ms"
