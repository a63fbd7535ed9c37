"""Control-structure interaction: the damper's force moves the table.

    Y(s) = G(s)·(e^(−L·s)·U(s) + compliance·damper_force(s))

where G is the table's loop of second order: the force acts without dead time. Not to be confused with `table.gain` or
`table.bandwidth`, which also act without any force of the damper.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "table",
    "payload",
    {
        "compliance": Parameter(
            "compliance", "m/N", null=0.0, least=0.0, most=0.002, sizes=(3e-07, 1.5e-06, 6e-06, 2.5e-05)
        ),
    },
    says="the damper's force moves the table",
    reference="Dyke, Spencer, Quast, Sain, J. Eng. Mech. 121 (1995) 322-338",
)
