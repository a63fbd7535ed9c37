"""The specimen of a part by itself: its force over its deformation, and the models that follow it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np

from common.plan.kinds import COLUMN
from diagnosis.fits.threads import each
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import LaboratoryPart, Part
from laboratories.effects.effect import Effect, Law, Parameter
from models.registry import Array
from models.specimens import fit as specimens
from models.specimens.fit import SpecimenFit

SLOW = ("layered", "bwbn")  # models whose fit takes ten times as long as another's
CLOSELY = 0.03  # of a force's rms: a model that leaves less has the specimen's loops
UNCRACKED = "uncracked"  # of a law with a first stiffness of its own: that over the planned one
BETTER = 0.8  # of what the best other model leaves: less of it is worth a model that takes long


def path(part: Part) -> tuple[Array, Array] | None:
    """Measured deformation (m) and force (N) of a part's column, where both are there; None where there is none.

    Of several recordings those of the one that goes farthest.
    """
    if isinstance(part, JoinedPart):
        ways = [way for piece in part.pieces if (way := path(piece)) is not None]
        return max(ways, key=lambda way: float(np.max(np.abs(way[0]))), default=None)
    if isinstance(part, ColumnAlone):
        there, deformation, force = part.present[:, 0], part.inputs, part.measured[:, 0]
    elif isinstance(part, LaboratoryPart) and part.lab.kind.name == COLUMN:
        there, (deformation, force) = np.all(part.present, axis=1), part.measured.T
    else:
        return None
    if not (np.any(deformation[there]) and np.any(force[there])):
        return None
    return deformation[there], force[there]


def follow(part: Part, way: tuple[Array, Array], models: Iterable[str]) -> dict[str, SpecimenFit]:
    """Models of specimens fitted to a path of deformation (m) and force (N), by name.

    Those that take long are fitted where all others leave much of the force, and left out where they leave about as
    much. A laboratory with its actuator is replayed in many short steps, so that they are not tried there.
    """
    known = tuple(item.tobytes() for item in way)

    def fits(names: Iterable[str]) -> list[SpecimenFit]:
        return each(lambda model: following(model, *known), names)

    found = fits(model for model in models if model not in SLOW)
    least = min((item.nrmse for item in found), default=0.0)
    slow = fits(model for model in models if model in SLOW and least > CLOSELY and by_itself(part))
    return {item.model: item for item in (*found, *(item for item in slow if item.nrmse < BETTER * least))}


def by_itself(part: Part) -> bool:
    """Whether a part is a column that is replayed from its measured deformation, in one recording or more."""
    if isinstance(part, JoinedPart):
        return all(by_itself(piece) for piece in part.pieces)
    return isinstance(part, ColumnAlone)


@lru_cache(maxsize=32)
def following(model: str, deformation: bytes, force: bytes) -> SpecimenFit:
    """A model of a specimen fitted to a path of deformation (m) and force (N); a search asks for it more than once."""
    return specimens.fit(model, np.frombuffer(deformation), np.frombuffer(force))


def as_specimen(
    effect: Effect, law: Law, strength: Parameter, found: Mapping[str, float], planned: float
) -> dict[str, float]:
    """The parameters of an effect under a law from those of the specimen that it is.

    `planned` is the stiffness in the plan, N/m.
    """
    known = {item.name: item for item in effect.every}
    values = dict(found)
    if UNCRACKED in law.shapes:
        values[UNCRACKED] = values["stiffness"] / planned
    if "first_bend" in values.keys() - law.shapes.keys():  # without it the law yields at the same force
        bend = values["first_bend"]
        values["yield_displacement"] *= bend + values["second_stiffness"] * (1.0 - bend)
    if "push" in values:
        push, pull = values["push"], values["pull"]
        values |= {"force": 0.5 * (push + pull), "asymmetry": (push - pull) / (push + pull)}
    names = (strength.name, *law.shapes)
    return {
        name: within(known[name], values.get(law.renamed.get(name, name), law.shapes.get(name, 0.0)))
        for name in names
    }


def within(parameter: Parameter, value: float) -> float:
    """A value within a parameter's bounds."""
    return min(max(value, parameter.least), parameter.most)
