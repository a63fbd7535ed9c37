"""What the master's topic calls what it sends: the kinds' names, and another where its own laboratory has that one."""

from __future__ import annotations

from common.plan.plan import Plan
from common.roles import MASTER
from common.signals import SENT_
from laboratories import kinds


def sent_names(plan: Plan) -> dict[str, tuple[str, ...]]:
    """The names in the master's topic of what each slave is sent, by role, in the order of its kind's `sent`.

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
