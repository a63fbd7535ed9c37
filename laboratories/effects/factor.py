"""Effects that are a factor on one thing alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def factor_on(
    site: str,
    thing: str,
    apply: Callable[..., System],
    *,
    says: str,
    reference: str,
    bounds: tuple[float, float],
    sizes: tuple[float, ...],
    meaning: str = "",
) -> Effect:
    """The effect `site.thing` with one parameter, `factor`, which is 1 where the effect is not there.

    Args:
        site: where it is, as `laboratories/effects/sites.py` lists them.
        thing: what is multiplied, the rest of the effect's name.
        apply: lays it over a system, given the factor; `of_plan` makes it for a parameter of the plan.
        says: what the effect is, in a few words.
        reference: a source or an equation.
        bounds: least and largest factor that is physically possible.
        sizes: factors on both sides of 1, from which a search starts.
        meaning: what the factor is on, where `says` leaves that open.
    """
    parameter = Parameter("factor", "", 1.0, *bounds, sizes, meaning)
    return Effect(f"{site}.{thing}", site, "physics", says, (parameter,), reference, apply)


def of_plan(table: str, key: str) -> Callable[..., System]:
    """The law that multiplies one parameter of the plan, every storey's where it has several."""
    return partial(multiplied, table=table, key=key)


def multiplied(system: System, factor: float, *, table: str, key: str) -> System:
    """The system with a parameter of the plan times `factor`."""
    return system.scaled(table, key, factor)
