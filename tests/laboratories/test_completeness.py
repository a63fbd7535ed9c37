"""A user's class that is not a complete kind of laboratory is refused in one sentence that says what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.errors import InputError, PlanError
from common.plan import read as plans
from laboratories.device import Device
from laboratories.kinds import kind_of, named
from tests.helpers import ROOT

CHANNELS = """Channels(
        target=Signal("wish", "m", "wanted"),
        command=Signal("told", "m", "written"),
        measured=(Signal("place", "m", "position"), Signal("push", "N", "force")),
        position="place",
        force="push",
    )"""
STEP = """
    @staticmethod
    def step(parameters, state, truth, command, effort):
        truth[0] = command
        truth[1] = parameters[1] * command
"""


def written(
    folder: Path, attributes: dict[str, str] | None = None, step: str = STEP, base: str = "Device"
) -> Device:
    """The kind of a file whose class has these attributes beside those of a complete one; empty ones are left out."""
    given = {"name": '"spring"', "says": '"a spring"', "channels": CHANNELS}
    given |= {"nominal": '{"stiffness": Nominal(1e6, "N/m", "of the spring")}'} | (attributes or {})
    body = "".join(f"    {name} = {text}\n" for name, text in given.items() if text)
    (folder / "own.py").write_text(
        "from laboratories.device import Channels, Device, Fault, Nominal, Signal\n\n\n"
        f"class Spring({base}):\n{body}{step}"
    )
    kind = named("own.py:Spring", folder, "[slave] kind")
    assert isinstance(kind, Device)
    return kind


def complaint(
    folder: Path, attributes: dict[str, str] | None = None, step: str = STEP, base: str = "Device"
) -> str:
    """The sentence in which such a class is refused."""
    with pytest.raises(InputError) as caught:
        written(folder, attributes, step, base)
    (sentence,) = str(caught.value).splitlines()
    assert sentence.endswith(".")
    return sentence


def test_a_complete_class_is_accepted_as_a_kind(tmp_path: Path) -> None:
    kind = written(tmp_path, {"rms": '{"push": 1.0}'})
    assert kind.name == "spring"
    assert [(one.channels, one.moved) for one in kind.sensed] == [(("push",), "place")]


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ({"says": "", "channels": ""}, "lacks says, channels"),
        (
            {"channels": "('place', 'push')"},
            "has channels of the class tuple, but must have laboratories.device.Channels",
        ),
        ({"states": "-1"}, "has states = -1, but must have the number of its states"),
        ({"name": '"My spring"'}, "has the name 'My spring', but a name begins with a letter"),
        (
            {"channels": CHANNELS.replace("told", "t")},
            "has a signal 't', which is the name of another signal of the recording",
        ),
        (
            {"channels": CHANNELS.replace("told", "wish_jerk")},
            "has a signal 'wish_jerk', which is the name of another signal",
        ),
        (
            {"channels": CHANNELS.replace('"place", "m"', '"push", "m"')},
            "has a signal 'push', which is the name of another",
        ),
        (
            {"channels": CHANNELS.replace('force="push"', 'force="pull"')},
            "has 'pull' for its force, but must name",
        ),
        (
            {"faults": '{"stiffness": Fault("a", "b", "", 1.0, 0.0, 2.0, (0.5,))}'},
            "has 'stiffness' in nominal and in",
        ),
        (
            {"faults": '{"worn": Fault("a", "b", "", 1.0, 0.0, 2.0, (3.0,))}'},
            "has a fault 'worn' whose null or sizes",
        ),
        ({"faults": '{"worn": Fault("a", "b", "", 1.0, 0.0, 2.0, ())}'}, "has a fault 'worn' without sizes"),
        ({"rms": '{"pull": 1.0}'}, "has 'pull' in rms, but may have there only place, push"),
        ({"most": '{"pull": 1.0}'}, "has 'pull' in most, but may have there only place, push, wish, told"),
        ({"damping": '"dashpot"'}, "has damping = 'dashpot', which is no parameter in nominal: stiffness"),
    ],
)
def test_an_attribute_that_is_missing_or_wrong_is_named(
    tmp_path: Path, attributes: dict[str, str], said: str
) -> None:
    sentence = complaint(tmp_path, attributes)
    assert sentence.startswith(f"Spring ({tmp_path / 'own.py'}) named in [slave] kind {said}")


def test_a_class_without_channels_and_one_with_seven_are_refused(tmp_path: Path) -> None:
    more = ", ".join(f'Signal("place{number}", "m", "")' for number in range(7))
    begin, end = CHANNELS.split("measured=(")
    rest = end[end.index("),\n        position") :]
    assert "measures 7 channels, but must measure 1 to 6" in complaint(
        tmp_path, {"channels": f"{begin}measured=({more}{rest}"}
    )
    (tmp_path / "none").mkdir()
    assert "measures 0 channels" in complaint(tmp_path / "none", {"channels": f"{begin}measured=({rest}"})


def test_a_class_that_is_not_a_device_or_has_no_step_is_refused(tmp_path: Path) -> None:
    assert complaint(tmp_path, base="object") == (
        "Spring named in [slave] kind is no kind of laboratory: derive it from laboratories.device.Device."
    )
    (tmp_path / "other").mkdir()
    assert "lacks step." in complaint(tmp_path / "other", step="")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("truth[0] = unknown", "NameError: name 'unknown' is not defined"),
        ("truth[0] = command.size", "Unknown attribute 'size' of type float64"),
        ("return command", "No conversion from float64 to none for"),
    ],
)
def test_a_step_that_does_not_compile_is_named_with_file_and_line(
    tmp_path: Path, line: str, said: str
) -> None:
    sentence = complaint(tmp_path, step=STEP + f"        {line}\n")
    file = tmp_path / "own.py"
    number = file.read_text().splitlines().index(f"        {line}") + 1
    begin = f"step of Spring named in [slave] kind cannot be compiled ({file}, line "
    assert sentence.startswith(begin)
    assert said in sentence
    if "NameError" not in said:  # Numba knows no line of it but the kernel's first
        assert sentence.startswith(f"{begin}{number}: {line}): ")


def test_a_step_with_other_arguments_is_refused(tmp_path: Path) -> None:
    assert "5 argument types given, but function takes 3 arguments" in complaint(
        tmp_path,
        step="\n    @staticmethod\n    def step(state, truth, command):\n        truth[0] = command\n",
    )


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("truth[2] = 0.0", "writes beyond the 2 numbers of truth"),
        ("state[0] = 1.0", "writes beyond the 0 numbers of state"),
        ("parameters[1] = 2.0", "changes parameters[1], which it may only read"),
        ("truth[1] = parameters[2]", "sets push (truth[1]) to no finite number along a sine of 1 mm"),
    ],
)
def test_a_step_that_accesses_memory_outside_its_arrays_is_refused_before_it_runs(
    tmp_path: Path, line: str, said: str
) -> None:
    sentence = complaint(tmp_path, step=STEP + f"        {line}\n")
    assert sentence.startswith(f"step of Spring ({tmp_path / 'own.py'}) named in [slave] kind {said}")


def test_a_channel_that_step_leaves_out_is_named(tmp_path: Path) -> None:
    assert "sets push (truth[1]) to no finite number" in complaint(
        tmp_path, step=STEP.rsplit("\n", 2)[0] + "\n"
    )


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (
            "[device.parameters]\nstifness = 1.0",
            "Unknown key 'stifness' in [device.parameters]: did you mean stiffness?",
        ),
        (
            '[device.parameters]\nstiffness = "3 kg"',
            "stiffness in [device.parameters] is in kg, which does not fit",
        ),
        (
            "[device.parameters]\nexponent = 5.0",
            "exponent in [device.parameters] is 5.0, but must be at least 0.1 and",
        ),
        (
            "[device.limits]\npiston_push = 1.0",
            "Unknown key 'piston_push' in [device.limits]: did you mean piston_",
        ),
        ("[device.noise]\npiston_target = 1.0", "Unknown key 'piston_target' in [device.noise]"),
    ],
)
def test_parameters_that_a_plan_gives_a_device_are_checked_by_its_class(table: str, said: str) -> None:
    plan = plans.parse(f'[slave]\nkind = "viscous_damper.py:ViscousDamper"\n{table}\n', ROOT / "examples")
    kind = kind_of(plan, "slave")
    with pytest.raises((InputError, PlanError)) as caught:
        (kind.coupling(plan), kind.limits(plan), kind.noise(plan))
    assert said in str(caught.value)


def test_parameters_of_the_plan_override_those_of_the_class() -> None:
    text = '[slave]\nkind = "viscous_damper.py:ViscousDamper"\n[device.parameters]\nstiffness = "30 kN/mm"\n'
    text += '[device.limits]\npiston_force = "100 kN"\n[device.noise]\npiston_force = 0.0\n'
    plan = plans.parse(text, ROOT / "examples")
    kind = kind_of(plan, "slave")
    assert isinstance(kind, Device)
    assert kind.values(plan)["stiffness"] == 30e6
    assert kind.limits(plan)["piston_force"] == 100e3
    assert kind.noise(plan).tolist() == [5e-6, 0.0]
