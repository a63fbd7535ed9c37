"""The classes and models that a plan would run, and where their code lies; none of it is imported here.

A plan that names a class, for a rig or for a kind of laboratory, or a model of the building that another program
computes, runs that code with the rights of the user who starts the test. The class of a kind also runs when the plan is
checked or simulated; the model, and that of a rig in OpenSees or in an FMU, when it is checked.
"""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import NamedTuple

from common.plan.plan import Plan
from common.plan.tables import OPENSEES
from loop.rigs import OWN

HOUSE = Path(__file__).parents[2]


class Code(NamedTuple):
    """One class, or one file of a model, that a plan names."""

    where: str  # table of the plan
    name: str  # as written in the plan
    file: str  # empty where none is found


def named(plan: Plan) -> list[Code]:
    """The code of a plan: the building's model, then classes of kinds of laboratory, then of rigs, in its order."""
    given = {role: kind for role, kind in plan.kinds.items() if ":" in kind}
    rigs = {"master.rig": plan.master.rig}
    rigs |= (
        {f"slave.{name}.rig": lab.rig for name, lab in plan.slaves.items()}
        if plan.slaves
        else {"slave.rig": plan.slave.rig}
    )
    given |= {where: rig.class_ for where, rig in rigs.items() if rig.class_}
    found = [Code(where, name, file_of(name, plan.base)) for where, name in given.items()]
    found += [
        Code(where, rig.options["file"], there(plan.base / rig.options["file"]))
        for where, rig in rigs.items()
        if rig.class_.startswith(OWN) and isinstance(rig.options.get("file"), str)
    ]
    if not plan.foreign:
        return found
    path = plan.base / plan.structure.model.removeprefix(OPENSEES)
    return [Code("structure", plan.structure.model, there(path)), *found]


def there(path: Path) -> str:
    """The whole path of a file, empty where there is none."""
    return str(path.resolve()) if path.is_file() else ""


def file_of(reference: str, base: Path) -> str:
    """The file that holds a class, empty where it is not there."""
    place = reference.rpartition(":")[0]
    if place.endswith(".py"):
        return there(base / place)
    return module_file(place)


def module_file(name: str) -> str:
    """The file of a module by its dotted name; packages are looked through, not imported."""
    path = [*sys.path, str(HOUSE)]  # a command that is installed need not have its own folder in `sys.path`
    found = None
    for number in range(1, name.count(".") + 2):
        full = ".".join(name.split(".")[:number])
        found = PathFinder.find_spec(full, path)
        if found is None:
            return ""
        path = list(found.submodule_search_locations or ())
    return found.origin or "" if found else ""
