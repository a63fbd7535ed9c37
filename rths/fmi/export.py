"""An emulated laboratory of a plan as an FMU."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from common.errors import InputError
from common.plan import read as plans
from common.plan.toml_file import text_of
from common.roles import MASTER, SLAVE, slave_role
from common.terminal import cli
from laboratories.kind import Kind
from loop import rigs
from rths.fmi import build, served


def export(plan_name: Path, path: Path, lab: str, reality_path: Path | None) -> Kind:
    """Write the FMU of a plan's laboratory, and return its kind; `lab` is master, slave, or the name of a slave.

    Raises:
        InputError: the plan has no such laboratory, the reality does not fit the plan, or there is no compiler.
    """
    file = cli.plan_path(str(plan_name))
    plan = plans.load(file)
    role = lab if lab in (MASTER, SLAVE) else slave_role(lab)
    if role not in plan.kinds:
        raise InputError(f"{file} has no laboratory '{lab}': give --lab as one of {', '.join(plan.kinds)}.")
    reality = cli.load_reality(reality_path, plan)
    rigs.check(reality.of(role), role)
    kind = rigs.hosted(reality.of(role), role)
    assert kind is not None  # noqa: S101 - the role has a laboratory
    channels = kind.channels
    folders = {"plan_folder": str(file.parent.resolve()), "role": role}
    texts = {served.PLAN: text_of(file, "plan")}
    if reality_path:
        folders["reality_folder"] = str(reality_path.parent.resolve())
        texts[served.REALITY] = text_of(reality_path, "reality")
    texts[served.ROLE] = json.dumps(folders)
    wanted = build.AskedFor(
        f"{plan.test.name}_{role}",
        kind.says,
        (channels.command, *([channels.effort] if channels.effort else [])),
        channels.measured,
        plan.test.interval,
        rigs.rig_seed(reality.of(role), role),
        plan.test.duration,
        (sys.executable, "-m", served.__name__),
        texts,
    )
    build.build(wanted, path)
    return kind
