"""Whether the rigs of a plan that stand in other processes are there, and how fast they answer; nothing moves."""

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
    """One rig as a plan names it, and what came of the exchanges with it."""

    terms: Terms
    channels: int  # the number of the plan's channels
    found: Echoes


def probe(terms: Terms, channels: int) -> Probed:
    """Exchange packets that move nothing with a rig; raises InputError where its address cannot be used."""
    peer = Peer(terms.address, terms.where)
    try:
        return Probed(terms, channels, echoes(peer, terms, secrets.randbits(32), channels))
    finally:
        peer.close()


def risk(probed: Probed, plan: Plan) -> Risk | None:
    """The risk of a rig that is not there, is another kind's, or answers too late; None where it serves."""
    terms, found = probed.terms, probed.found
    if found.answer is None:
        return Risk("rig", unanswered(terms))
    if complaint := compared(found.answer, probed.channels):
        return Risk("rig", f"of the rig at {terms.address} {complaint}")
    return slow(terms, found.round_trips_s, found.lost, plan)


def slow(terms: Terms, round_trips_s: Sequence[float], lost: int, plan: Plan) -> Risk | None:
    """The risk of a rig whose answers are lost, or come too late too often in real time."""
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
    """What a rig has passed, in words."""
    return f"Rig at {terms.address}: {len(round_trips_s)} exchanges, {trips(round_trips_s)}"


def trips(round_trips_s: Sequence[float]) -> str:
    """Round trips in words, to the microsecond."""
    ranked = sorted(round_trips_s)
    p50, p99 = (quantile(ranked, part) * 1e3 for part in (0.5, 0.99))
    return f"round trip p50 {p50:.3f} ms, p99 {p99:.3f} ms"
