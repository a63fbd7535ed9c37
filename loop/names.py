"""The names of sent signals in the master's topic, which differ where its own laboratory has the same signal."""

from __future__ import annotations

from common.plan.plan import Plan
from common.roles import MASTER
from common.signals import SENT_
from laboratories import kinds


def sent_names(plan: Plan) -> dict[str, tuple[str, ...]]:
    """The names in the master's topic of the values sent to each slave, by role, in the order of its kind's `sent`.

    Raises:
        InputError: a kind cannot be loaded, or two signals would have one name.
    """
    own = {row.name for row in kinds.topics(plan)[MASTER] if not row.slaves}
    hosted = kinds.kinds_of(plan)
    return {
        role: tuple(SENT_ + name if name in own else name for name in kind.channels.sent)
        for role, kind in hosted.items()
        if role != MASTER
    }
