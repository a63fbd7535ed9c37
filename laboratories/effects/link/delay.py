"""Messages take longer than planned, equally in both directions.

    a message sent at t is available from the first tick at or after its nominal time + delay

so the round trip is longer by two delays, each rounded up to whole intervals. Not to be confused with
`table.delay`: the messages' time stamps distinguish them.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "link",
    "delay",
    {
        "delay": Parameter(
            "delay",
            "s",
            null=0.0,
            least=0.0,
            most=1.0,
            sizes=(0.001, 0.003, 0.007, 0.015, 0.03),
            says="added to each direction",
        ),
    },
    says="messages take longer",
    reference="available from the first tick at or after nominal time + delay",
)
