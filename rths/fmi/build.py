"""An FMU (FMI 3.0, co-simulation) around a program that takes commands and gives measurements at an interval."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

from common.errors import InputError
from common.signals import Signal

SOURCE = Path(__file__).with_name("fmu.c")
IDENTIFIER = "rths_laboratory"  # of the shared library
FIRST_INPUT, FIRST_OUTPUT, SEED = 10, 100, 1  # value references, as in the source
EXPONENTS = {"m": {"m": 1}, "s": {"s": 1}, "N": {"kg": 1, "m": 1, "s": -2}}  # of units in SI base units
EXPONENTS |= {"m/s": {"m": 1, "s": -1}, "m/s²": {"m": 1, "s": -2}}
PLATFORM = f"{ {'AMD64': 'x86_64', 'arm64': 'aarch64'}.get(platform.machine(), platform.machine()) }-linux"


class AskedFor(NamedTuple):
    """Everything that an FMU is built from."""

    name: str
    says: str
    inputs: Sequence[Signal]
    outputs: Sequence[Signal]
    interval: float  # s
    seed: int
    stop: float  # s, suggested end of a simulation
    command: Sequence[str]  # the program and its arguments; the folder of the resources is the last argument
    resources: Mapping[str, str]  # texts by file name


def build(wanted: AskedFor, path: Path) -> None:
    """Write an FMU for this machine.

    Raises:
        InputError: the system is not Linux, or has no C compiler.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not sys.platform.startswith("linux") or compiler is None:
        raise InputError(
            "An FMU is compiled on Linux with a C compiler, but there is no `cc` here: install gcc."
        )
    token = hashlib.blake2b(repr(wanted).encode(), digest_size=16).hexdigest()
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / f"{IDENTIFIER}.so"
        numbers = {"INPUTS": len(wanted.inputs), "OUTPUTS": len(wanted.outputs), "SEED_START": wanted.seed}
        given = [f"-D{name}={value}" for name, value in numbers.items()]
        given += [f"-DINTERVAL={wanted.interval!r}", f'-DTOKEN="{token}"']
        words: list[str | Path] = [
            compiler,
            "-shared",
            "-fPIC",
            "-O2",
            "-fvisibility=hidden",
            *given,
            SOURCE,
            "-lm",
            "-o",
            library,
        ]
        subprocess.run(words, check=True)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", description(wanted, token))
            archive.write(library, f"binaries/{PLATFORM}/{library.name}")
            for name, text in {**wanted.resources, "command": "\n".join(wanted.command)}.items():
                archive.writestr(f"resources/{name}", text)


def description(wanted: AskedFor, token: str) -> bytes:
    """The model description, as XML."""
    root = Xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": wanted.name,
            "instantiationToken": token,
            "description": wanted.says,
            "generationTool": "rths",
            "variableNamingConvention": "flat",
        },
    )
    Xml.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": IDENTIFIER,
            "needsExecutionTool": "true",
            "canHandleVariableCommunicationStepSize": "false",
            "fixedInternalStepSize": repr(wanted.interval),
        },
    )
    units(root, wanted)
    Xml.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0", "stopTime": repr(wanted.stop), "stepSize": repr(wanted.interval)},
    )
    variables(root, wanted)
    structure = Xml.SubElement(root, "ModelStructure")
    for tag in ("Output", "InitialUnknown"):
        for place in range(len(wanted.outputs)):
            Xml.SubElement(structure, tag, {"valueReference": str(FIRST_OUTPUT + place)})
    Xml.indent(root)
    found: bytes = Xml.tostring(root, encoding="UTF-8", xml_declaration=True)
    return found


def units(root: Xml.Element, wanted: AskedFor) -> None:
    """Write the units of all variables; an unknown unit has no exponents of base units."""
    table = Xml.SubElement(root, "UnitDefinitions")
    for name in dict.fromkeys(["s", *(row.unit for row in (*wanted.inputs, *wanted.outputs) if row.unit)]):
        unit = Xml.SubElement(table, "Unit", {"name": name})
        if name in EXPONENTS:
            Xml.SubElement(unit, "BaseUnit", {base: str(power) for base, power in EXPONENTS[name].items()})


def variables(root: Xml.Element, wanted: AskedFor) -> None:
    """Write the variables: time, seed, inputs and outputs."""
    table = Xml.SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": "0", "causality": "independent", "variability": "continuous"}
    Xml.SubElement(table, "Float64", {**time, "unit": "s"})
    seed = {"name": "seed", "valueReference": str(SEED), "causality": "parameter", "variability": "fixed"}
    Xml.SubElement(
        table, "Int64", {**seed, "start": str(wanted.seed), "description": "seed of the sensors' noise"}
    )
    parts = (("input", FIRST_INPUT, wanted.inputs), ("output", FIRST_OUTPUT, wanted.outputs))
    for causality, first, rows in parts:
        for place, row in enumerate(rows):
            given = {"name": row.name, "valueReference": str(first + place), "causality": causality}
            given |= {"variability": "discrete", "description": row.text}
            given |= {"unit": row.unit} if row.unit else {}
            given |= {"start": "0"} if causality == "input" else {"initial": "calculated"}
            Xml.SubElement(table, "Float64", given)
