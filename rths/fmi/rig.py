"""An FMU (FMI 3.0, co-simulation) as a rig, or as the specimen under the emulated actuator."""

from __future__ import annotations

import re
import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from common.errors import InputError, RigError
from laboratories.column.under_actuator import Array, UnderActuator
from laboratories.kinds import KINDS

INSTALL = "`make fmi` installs FMPy"
REMEDY = "export it by FMI 3.0 for co-simulation"


def library(name: str) -> Any:
    """A module of FMPy; raises InputError where it is not installed."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise InputError(
            f"An FMU cannot be loaded, because {error.name} is not installed: {INSTALL}."
        ) from None


def version_of(file: str) -> str:
    """The version of FMI that an FMU says; raises InputError where the file is none."""
    try:
        with zipfile.ZipFile(file) as archive:
            text = archive.read("modelDescription.xml")
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise unreadable(file, error) from None
    found = re.search(rb"""fmiVersion\s*=\s*["']([^"']*)""", text)
    if found is None:
        raise unreadable(file, ValueError("its modelDescription.xml says no fmiVersion"))
    return found[1].decode(errors="replace")


def unreadable(file: str, error: Exception) -> InputError:
    """The message for a file that is no FMU."""
    why = " ".join(str(error).split()).rstrip(".") or type(error).__name__
    return InputError(f"{file} cannot be read as an FMU ({why}): {REMEDY}.")


class Fmu:
    """An instance of an FMU that is stepped at an interval.

    `inputs` and `outputs` are names of its variables of type Float64, `start` values by name.

    Raises:
        InputError: the file is no FMU of FMI 3.0 for co-simulation, or lacks a variable.
    """

    def __init__(
        self,
        file: str,
        interval: float,
        inputs: Sequence[str],
        outputs: Sequence[str],
        start: Mapping[str, Any],
    ) -> None:
        fmpy = library("fmpy")
        if not Path(file).is_file():
            raise InputError(f"There is no FMU {file}: give the path of its file.")
        version = version_of(file)
        try:
            if version.startswith("3."):
                self._description = fmpy.read_model_description(file)
        except Exception as error:  # FMPy raises many types for a damaged archive or description
            raise unreadable(file, error) from None
        if not version.startswith("3."):
            raise InputError(f"{file} is of FMI {version}: {REMEDY}.")
        if self._description.coSimulation is None:
            raise InputError(f"{file} is not for co-simulation: {REMEDY}.")
        self._references = {row.name: row.valueReference for row in self._description.modelVariables}
        inputs, outputs = inputs or self._channels()[0], outputs or self._channels()[1]
        self._inputs, self._outputs = (self._of(file, names) for names in (inputs, outputs))
        self._of(file, start)
        self._file, self._start, self._interval, self._ticks = file, dict(start), interval, 0
        self._instance: Any = None
        self._folder = self._said = ""  # where the FMU is unpacked; its last error message

    def _channels(self) -> tuple[Sequence[str], Sequence[str]]:
        """The names of commands and measurements of the shipped kind whose channels the FMU's variables have."""
        for kind in KINDS.values():
            pair = (kind.channels.drives, kind.channels.names)
            if set(pair[0]) | set(pair[1]) <= self._references.keys():
                return pair
        raise InputError(
            f"The variables of {self._description.modelName} do not have the names of a kind's channels: give inputs "
            "and outputs."
        )

    def _of(self, file: str, names: Iterable[str]) -> list[int]:
        for name in names:
            if name not in self._references:
                known = ", ".join(list(self._references)[:12])
                raise InputError(f"{file} has no variable '{name}': it has {known}.")
        return [self._references[name] for name in names]

    def suggest(self, name: str, value: Any) -> None:
        """Set the start value of a variable if the FMU has it and no other value was given."""
        if name in self._references:
            self._start.setdefault(name, value)

    def begin(self) -> None:
        """Load and initialize the FMU; raises RigError if that fails."""
        fmpy, simulation = library("fmpy"), library("fmpy.simulation")
        self._folder = tempfile.mkdtemp(prefix="rths-fmu-")
        try:
            fmpy.extract(self._file, self._folder)
            self._instance = simulation.instantiate_fmu(
                self._folder, self._description, "CoSimulation", logger=self._told
            )
            simulation.apply_start_values(self._instance, self._description, self._start)
            self._instance.enterInitializationMode(startTime=0.0)
            self._instance.exitInitializationMode()
        except Exception as error:  # FMPy and the FMU raise many types
            shutil.rmtree(self._folder, ignore_errors=True)
            raise RigError(
                f"the FMU {Path(self._file).name} cannot be started: {self._said or error}"
            ) from None

    def _told(self, _environment: Any, status: int, _category: bytes, message: bytes) -> None:
        if status > 1:  # more severe than a warning
            self._said = message.decode(errors="replace")

    def step(self, values: Sequence[float], share: float = 1.0) -> None:
        """Set the inputs and advance by a share of the interval; raises RigError if the FMU refuses."""
        length = share * self._interval
        try:
            self._instance.setFloat64(self._inputs, list(values))
            self._instance.doStep(
                currentCommunicationPoint=self._ticks * length, communicationStepSize=length
            )
        except Exception as error:  # as above
            raise RigError(f"the FMU {Path(self._file).name} failed: {self._said or error}") from None
        self._ticks += 1

    def outputs(self) -> list[float]:
        """The present outputs."""
        found: list[float] = self._instance.getFloat64(self._outputs)
        return found

    def end(self) -> None:
        """Terminate the FMU, and delete its unpacked files."""
        instance, self._instance = self._instance, None
        try:
            if instance is not None:
                instance.terminate()
                instance.freeInstance()
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)


class Rig:
    """A whole laboratory in an FMU.

    `inputs` are the FMU's variables for the commands and `outputs` those for the measurements, in the order of the
    kind's channels. If they are not given, the variables must have the names of the channels of a shipped kind. If the
    FMU has a parameter `seed`, it is set, unless `start` gives it.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        file: str,
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
        start: Mapping[str, Any] | None = None,
    ) -> None:
        self._fmu = Fmu(file, interval, inputs, outputs, start or {})
        self._fmu.suggest("seed", seed)

    def arm(self) -> None:
        """Load and initialize the FMU."""
        self._fmu.begin()

    def read(self) -> list[float]:
        """The present measurements."""
        return self._fmu.outputs()

    def write(self, command: Sequence[float]) -> None:
        """Advance by one interval under a command."""
        self._fmu.step(command)

    def disarm(self) -> None:
        """End the FMU."""
        self._fmu.end()


class Specimen(UnderActuator):
    """A specimen in an FMU under the emulated actuator: the FMU takes a deformation (m) and gives a force (N).

    `names` has the FMU's names for `deformation` and `force` if they differ from these.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        file: str,
        names: Mapping[str, str] | None = None,
        start: Mapping[str, Any] | None = None,
        actuator: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        substeps: int = 1,
    ) -> None:
        super().__init__(interval, seed, self._forced, actuator, sensors, substeps)
        own = {"deformation": "deformation", "force": "force"} | dict(names or {})
        if len(own) > 2:
            raise InputError("names of an FMU's specimen takes the keys deformation and force only.")
        self._fmu = Fmu(file, interval, [own["deformation"]], [own["force"]], start or {})
        self._share = 1.0 / substeps

    def _forced(self, way: Array) -> float:
        for place in way.tolist():
            self._fmu.step([place], self._share)
        return self._fmu.outputs()[0]

    def arm(self) -> None:
        """Load and initialize the FMU."""
        self._fmu.begin()

    def disarm(self) -> None:
        """Leave the actuator where it is, and end the FMU."""
        self._fmu.end()
