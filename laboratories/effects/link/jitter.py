"""Messages take varying times.

    delay of a message = delay + n,    n exponential: mean and standard deviation are std

with the delay of `link.delay`, in both directions. Only the number of whole intervals by which a message is late has an
effect. Not to be confused with noise of the damper's force: the age of each message distinguishes them.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "link",
    "jitter",
    {
        "jitter": Parameter(
            "std",
            "s",
            null=0.0,
            least=0.0,
            most=0.2,
            sizes=(0.0003, 0.001, 0.003, 0.01),
            says="standard deviation",
        ),
    },
    says="messages take varying times",
    reference="delay of a message = delay + n, n exponential of standard deviation std",
)
