"""zenoh's access control on the link: which role may publish and subscribe on which route.

The master's session routes all messages and applies these rules to every other session, by the common name of its
certificate. Whatever is not allowed here is denied: other keys, wildcards, deletions, queries, tokens.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from common.link.transport import Route, heard, said
from common.roles import OBSERVER, OPERATOR, RECORDER


def guests(slaves: Sequence[str]) -> tuple[str, ...]:
    """The roles that connect to the master."""
    return (*slaves, RECORDER, OPERATOR, OBSERVER)


def access_control(slaves: Sequence[str], key: Callable[[Route], str]) -> dict[str, object]:
    """The value of zenoh's `access_control` for the master; `key` gives the key expression of a route."""
    rules, policies = [], []
    for role in guests(slaves):
        own = rules_of(
            role, [key(route) for route in said(role, slaves)], [key(route) for route in heard(role, slaves)]
        )
        rules += own
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [role]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": role, "cert_common_names": [role]} for role in guests(slaves)],
        "policies": policies,
    }


def rules_of(role: str, says: Sequence[str], hears: Sequence[str]) -> list[dict[str, object]]:
    """The rules of one role: `ingress` is what the master's session receives from it, `egress` what it sends to it.

    A publisher sends only on keys for which the router has told it of a subscriber, which the rule `wanted` allows.
    """
    allowed = (
        ("says", "ingress", "put", says),
        ("wanted", "egress", "declare_subscriber", says),
        ("asks", "ingress", "declare_subscriber", hears),
        ("hears", "egress", "put", hears),
    )
    return [
        {
            "id": f"{role} {verb}",
            "permission": "allow",
            "flows": [flow],
            "messages": [message],
            "key_exprs": list(keys),
        }
        for verb, flow, message, keys in allowed
        if keys  # zenoh refuses a rule without any
    ]
