"""Messages are lost, singly or several in a row; the last one received stays in use.

    P(lost) = probability,    mean run of lost messages = burst

This is a two-state chain (Gilbert): from good to bad with p = r·probability/(1 − probability), back with r = 1/burst.
Not to be confused with `link.jitter`, with which messages come late but come.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "link",
    "loss",
    {
        "loss": Parameter(
            "probability",
            "",
            null=0.0,
            least=0.0,
            most=0.95,
            sizes=(0.002, 0.01, 0.05, 0.2),
            says="share of messages lost",
        ),
        "burst": Parameter(
            "burst",
            "",
            null=1.0,
            least=1.0,
            most=500.0,
            sizes=(1.0, 5.0, 20.0),
            says="mean messages lost in a row",
            shape=True,
        ),
    },
    says="messages are lost",
    reference="Gilbert, Bell Syst. Tech. J. 39 (1960) 1253-1265",
)
