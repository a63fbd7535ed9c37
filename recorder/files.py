"""The file of a test: its name, and the content before the first sample."""

from __future__ import annotations

import contextlib
import os
import platform
import time
from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from types import MappingProxyType

from common.errors import InputError
from common.host.clock import unix_ns
from common.host.machine import facts
from common.lab.preflight import ACCEPTED
from common.plan.plan import Plan
from common.recording.run import CLOCK
from common.recording.writer import Recording
from common.safety.risks import Risk
from common.signals import Signal
from common.terminal import outputs
from laboratories.kinds import topics
from models.ground_motion import GroundMotion
from models.registry import Array

# The record of a plan's ground motion, and its rows as `loop.substructure.ground_rows` gives them.
MotionRows = tuple[GroundMotion, Array]
PACKAGES = ("rths", "eclipse-zenoh", "mcap", "msgpack", "numba", "numpy", "protobuf", "scipy")


@contextlib.contextmanager
def reserved(given: Path | None, plan: Plan, label: str = "", *, force: bool = False) -> Iterator[Path]:
    """Reserve a file for a recording: the one given, or `<test>[-<label>]-<time>.mcap` in the plan's folder.

    The folder is created. At the end of the context the file is removed if nothing was recorded. Where two tests begin
    in one second, the name of the second file ends in `-2`.

    Raises:
        InputError: a file is there and `force` is not given, or no recording can be written there.
    """
    if given is not None:
        with outputs.reserved(checked(given), force) as path:
            yield path
        return
    folder = Path(plan.recording.folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"Cannot create the folder {folder} for recordings: {error.strerror}; give a file with -o."
        ) from None
    name = f"{plan.test.name}-{label}" if label else plan.test.name
    with outputs.free_name(folder, f"{name}-{time.strftime('%Y%m%d-%H%M%S')}", ".mcap") as path:
        yield path


def checked(path: Path) -> Path:
    """The path, unless it is a pipe or the standard output, which could block the recorder; raises InputError."""
    if outputs.is_stream(path) and (str(path) in outputs.STANDARD or not path.is_char_device()):
        raise InputError(f"Cannot record a test into {path}, which is not a file: give a file with -o.")
    return path


def begin(
    path: Path,
    plan: Plan,
    ground: MotionRows | None,
    at_ns: int = 0,
    accepted: Sequence[Risk] = (),
    *,
    clock: str = "virtual",
    more: Mapping[str, tuple[Signal, ...]] = MappingProxyType({}),
) -> Recording:
    """Begin a recording with schemas, plan, versions, host, `ground` motion and a first event at `at_ns` (Unix).

    `clock` is the test's kind of clock, `virtual` or `real`; `more` are topics beside the test's. The recording is
    flushed, because the metadata reach the file with the first chunk only.

    Raises:
        InputError: the disk does not take it.
    """
    recording = Recording(path, plan.test.name, plan.storeys, {**topics(plan), **more}, plan.roles)
    recording.metadata("plan", {"toml": plan.toml(), "digest": plan.digest()})
    recording.describe()
    recording.metadata("versions", {name: metadata.version(name) for name in PACKAGES})
    recording.metadata("host", host() | facts())
    recording.metadata(CLOCK, {"kind": clock})
    if ground is not None:
        record, rows = ground
        recording.ground(record.describe(), plan.ground_motion.scale, rows)
    recording.add("event", at_ns, at_ns, (0.0, "recorder", "info", "begin", "recording begun", {}))
    for risk in accepted:
        text = f"risk '{risk.name}' accepted: {risk.sentence}."
        recording.add("event", at_ns, at_ns, (0.0, "recorder", "warning", ACCEPTED, text, {}))
    try:
        recording.flush()
    except OSError as error:
        recording.abandon()
        raise InputError(
            f"Cannot begin the recording {path}: {error.strerror}; free disk space or give another file with -o."
        ) from None
    return recording


def host() -> dict[str, str]:
    """The facts of the machine that the recorder runs on."""
    return {
        "system": platform.platform(),
        "machine": platform.machine(),
        "processors": str(os.cpu_count()),
        "python": platform.python_version(),
        "recorded_unix_ns": str(unix_ns()),
    }
