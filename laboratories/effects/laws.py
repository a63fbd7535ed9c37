"""The laws that most effects share: a factor, an addition to a parameter of the plan, or fields of `Effects`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from laboratories.effects.effect import Effect, Parameter
from models.system import System

Apply = Callable[..., System]


def factor_on(
    site: str,
    thing: str,
    apply: Apply,
    *,
    says: str,
    reference: str,
    bounds: tuple[float, float],
    sizes: tuple[float, ...],
    meaning: str = "",
    **more: Any,
) -> Effect:
    """The effect `site.thing` with one parameter, `factor`, which is 1 without the effect.

    Args:
        site: one of those in `laboratories/effects/sites.py`.
        thing: the quantity that is multiplied, the rest of the effect's name.
        apply: applies it to a system, given the factor; `of_plan` and `of_site` make it.
        says: a short description of the effect.
        reference: a source or an equation.
        bounds: smallest and largest factor that is physically possible.
        sizes: factors on both sides of 1, from which a search starts.
        meaning: the quantity that the factor multiplies, if `says` does not make that clear.
        more: further fields of `Effect`.
    """
    parameter = Parameter("factor", "", 1.0, *bounds, sizes, meaning)
    return Effect(f"{site}.{thing}", site, "physics", says, (parameter,), reference, apply, **more)


def sets(
    site: str,
    thing: str,
    fields: Mapping[str, Parameter],
    *,
    says: str,
    reference: str,
    further: Mapping[str, Parameter] | None = None,
    **more: Any,
) -> Effect:
    """The effect `site.thing` whose parameters set fields of the site's record in `models.system.Effects`.

    Args:
        site: one of those in `laboratories/effects/sites.py`.
        thing: the rest of the effect's name.
        fields: the parameter that sets each field. The first one is the effect's magnitude; at its null value the
            others, which are parameters of shape, have no influence.
        says: a short description of the effect.
        reference: a source or an equation.
        further: optional parameters, by the field that each sets; the empty field sets none.
        more: further fields of `Effect`.
    """
    rest = further or {}
    names = {field: parameter.name for field, parameter in (*fields.items(), *rest.items()) if field}
    parameters = tuple(fields.values())
    law = partial(laid, site=site, fields=names, null=parameters[0].null)
    more |= {"further": tuple(rest.values())}
    return Effect(f"{site}.{thing}", site, "physics", says, parameters, reference, law, **more)


def laid(system: System, *, site: str, fields: Mapping[str, str], null: float, **given: float) -> System:
    """The system with fields of a site's record set, by the names of the parameters in `given`."""
    untouched = type(getattr(system.effects, site))()
    values = {field: given.get(name, getattr(untouched, field)) for field, name in fields.items()}
    if next(iter(values.values())) == null:
        values = {field: getattr(untouched, field) for field in fields}
    return system.laid(site, **values)


def of_site(site: str, field: str) -> Apply:
    """The law that multiplies one field of a site's record, which is 1 without an effect."""
    return partial(strengthened, site=site, field=field)


def strengthened(system: System, factor: float, *, site: str, field: str) -> System:
    """The system with a field of a site's record times `factor`, so that several effects may act on it."""
    return system.laid(site, **{field: factor * getattr(getattr(system.effects, site), field)})


def of_plan(table: str, key: str) -> Apply:
    """The law that multiplies one parameter of the plan, in every storey."""
    return partial(multiplied, table=table, key=key)


def multiplied(system: System, factor: float, *, table: str, key: str) -> System:
    """The system with a parameter of the plan times `factor`."""
    return system.scaled(table, key, factor)


def added(system: System, *, table: str, key: str, **given: float) -> System:
    """The system with the one parameter given added to a parameter of the plan, in total not below 0."""
    (more,) = given.values()
    return system.moved(table, **{key: max(getattr(getattr(system.plan, table), key) + more, 0.0)})


def which_law(most: float, says: str) -> Parameter:
    """The parameter `law`, by which an effect with laws 0 to `most` chooses its formula; `says` names them."""
    return Parameter("law", "", null=0.0, least=0.0, most=most, sizes=(), says=says, shape=True)


def of_second_order() -> Parameter:
    """The shape `damping` of a lag T of second order: its damping ratio ζ in (T/2ζ)²·ÿ + T·ẏ + y = x."""
    return Parameter(
        "damping",
        "",
        null=math.inf,
        least=0.2,
        most=2.0,
        sizes=(0.7,),
        says="damping ratio ζ of law 1, whose time constant is 2ζ/ω",
        shape=True,
    )


def bend_sharpness(says: str) -> Parameter:
    """The shape `sharpness` n of a limit L that a machine reaches gradually, by x/(1 + |x/L|ⁿ)^(1/n); inf: suddenly."""
    return Parameter(
        "sharpness", "", null=math.inf, least=1.0, most=20.0, sizes=(1.5, 3.0), says=says, shape=True
    )


def extra_time(name: str, sizes: tuple[float, ...]) -> Parameter:
    """The parameter of a time (s) that is added to a planned delay or lag, from −50 ms to 0.2 s.

    The bounds are wide: the nominal actuator's whole delay is 44 ms, and hardly any loop is stable with 0.2 s.
    """
    return Parameter(name, "s", null=0.0, least=-0.05, most=0.2, sizes=sizes, says="added")


def adds(
    site: str, thing: str, key: str, parameter: Parameter, *, says: str, reference: str, **more: Any
) -> Effect:
    """The effect `site.thing` that adds to the parameter `key` of the plan's table of that name, in total not below 0.

    Args:
        site: the site, and the plan's table of that name.
        thing: the rest of the effect's name.
        key: the table's key.
        parameter: the parameter that is added.
        says: a short description of the effect.
        reference: a source or an equation.
        more: further fields of `Effect`.
    """
    law = partial(added, table=site, key=key)
    return Effect(f"{site}.{thing}", site, "physics", says, (parameter,), reference, law, **more)
