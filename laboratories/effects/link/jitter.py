"""Messages take varying times.

    delay of a message = delay + n,    n ~ Gamma(shape, std/√shape): its mean is std·√shape, its standard deviation std

with the delay of `link.delay`, in both directions. With `shape` 1 it is exponential, with 2 nearly half of a normal
distribution. Only the number of whole intervals by which a message is late has an
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
    further={
        "jitter_shape": Parameter(
            "shape",
            "",
            null=1.0,
            least=0.2,
            most=20.0,
            sizes=(1.0, 2.0),
            says="of their Gamma distribution, 1 for an exponential one",
            shape=True,
        ),
    },
    says="messages take varying times",
    reference="delay of a message = delay + n, n ~ Gamma(shape, std/√shape)",
)
