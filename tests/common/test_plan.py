from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import PlanError
from common.plan import read as plans
from common.plan.patience import strict
from common.plan.plan import Plan
from common.plan.read import from_tables, parse, with_test
from common.reality import reality
from common.terminal import cli


def test_the_shipped_default_plan_equals_a_plan_of_defaults(default_plan: Plan) -> None:
    assert default_plan.tables() == Plan().tables()


def test_the_paper_plan_differs_from_the_default_in_name_and_lead_only(default_plan: Plan) -> None:
    tables = strict(plans.load(cli.plan_path("paper"))).tables()
    tables["test"]["name"], tables["compensator"]["lead"] = "default", 0.044
    assert tables == default_plan.tables()


def test_the_default_plan_has_the_specified_values(default_plan: Plan) -> None:
    assert default_plan.ticks == 20_000
    assert default_plan.structure.mass == (160_000.0,)
    assert default_plan.structure.stiffness == (25e6,)
    assert default_plan.column.stiffness == 12.5e6
    assert (default_plan.actuator.delay, default_plan.actuator.time_constant) == (0.014, 0.030)
    assert default_plan.compensator.parameters == {
        "lead": 0.044,
        "proportional": 1.93,
        "integral": 0.047,
        "derivative": 0.0,
    }
    assert (default_plan.damper.force_scale, default_plan.control.gain) == (100.0, 120_000.0)


WRONG = {
    "unknown table": ("[colum]\n", r"Unknown table \[colum\]: did you mean column"),
    "unknown key": ("[column]\nstifness = 1.0\n", None),
    "unknown key of a closed table": (
        "[actuator]\ndelai = 0.1\n",
        "Unknown key 'delai' in .actuator.: did you mean delay",
    ),
    "text for a number": (
        "[test]\nduration = '3'\n",
        r"duration in \[test\] must be a number in s, or one with its unit, not '3'",
    ),
    "number for a truth": ("[control]\namd = 1\n", r"amd in \[control\] must be true or false, not 1"),
    "number for a text": ("[test]\nname = 3\n", r"name in \[test\] must be a text in quotes, not 3"),
    "broken number for a count": (
        "[column]\nstorey = 1.5\n",
        r"storey in \[column\] must be a whole number, not 1.5",
    ),
    "truth for a number": ("[test]\nduration = true\n", "must be a number, not True"),
    "below the range": ("[test]\nduration = -1.0\n", r"duration in \[test\] is -1.0, but must be above 0"),
    "not a number": (
        "[ground_motion]\nscale = nan\n",
        r"scale in \[ground_motion\] is nan, but must be finite",
    ),
    "infinite": ("[ground_motion]\nscale = inf\n", "must be finite"),
    "name with a slash": ("[test]\nname = 'a/b'\n", "use lower-case letters, digits, - and _"),
    "value for a table": ("column = 3\n", r"\[column\] must be a table, not 3"),
    "lengths that differ": ("[structure]\nmass = [1.0, 2.0]\n", "has 2 masses but 1 values of stiffness"),
    "dashpots missing": (
        "[structure]\nmass = [1.0, 2.0]\nstiffness = [1.0, 2.0]\n",
        "has 2 masses but 1 values of damping: give one per storey, or damping_ratio in their place",
    ),
    "storey that is not there": (
        "[column]\nstorey = 2\n",
        r"storey in \[column\] is 2, but the structure has 1",
    ),
    "floor that is not there": (
        "[damper]\nfloor = 2\n",
        r"floor in \[damper\] is 2, but the structure has 1",
    ),
    "more columns than there are": (
        "[column]\nrepresents = 5\n",
        "represents in .column. is 5, but the storey has 4",
    ),
    "tolerance of nothing": ("[tolerances]\n'column.stifness' = 0.1\n", "did you mean column.stiffness"),
    "tolerance beyond all": ("[tolerances]\n'column.stiffness' = 1.1\n", "must be at least 0 and at most 1"),
    "shorter than an interval": ("[test]\nduration = 0.0001\n", "shorter than one interval"),
    "no TOML": ("[test\n", "not valid TOML"),
}


@pytest.mark.parametrize("text_and_message", WRONG.values(), ids=WRONG.keys())
def test_a_wrong_plan_is_refused_in_one_sentence(text_and_message: tuple[str, str | None]) -> None:
    text, message = text_and_message
    if message is None:
        assert parse(text, Path()).column.parameters == {"stifness": 1.0}  # the model's registry refuses it
        return
    with pytest.raises(PlanError, match=message) as error:
        parse(text, Path(), "my.toml")
    assert str(error.value).startswith("my.toml")
    assert "\n" not in str(error.value)


def test_a_message_about_an_unreadable_plan_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"missing.toml: No such file"):
        plans.load(tmp_path / "missing.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(PlanError, match="not UTF-8"):
        plans.load(tmp_path / "binary.toml")


@given(
    duration=st.floats(0.002, 7200.0),
    scale=st.floats(-10.0, 10.0),
    mass=st.lists(st.floats(1.0, 1e9), min_size=1, max_size=5),
    frequency=st.one_of(st.just(math.inf), st.floats(0.1, 1e3)),
)
def test_a_plan_is_the_same_after_being_written_and_read(
    duration: float, scale: float, mass: list[float], frequency: float
) -> None:
    n = len(mass)
    tables = {
        "test": {"duration": duration},
        "ground_motion": {"scale": scale},
        "structure": {"mass": mass, "stiffness": [1e6] * n, "damping": [0.0] * n},
        "table": {"frequency": frequency},
    }
    original = from_tables(tables, Path())
    returned = parse(original.toml(), Path())
    assert returned == original
    assert returned.digest() == original.digest()


def test_the_digest_depends_on_the_test_but_not_on_the_recording_folder(default_plan: Plan) -> None:
    assert with_test(default_plan, scale=0.2).digest() != default_plan.digest()
    assert with_test(default_plan, seed=9).digest() != default_plan.digest()
    elsewhere = from_tables(default_plan.tables() | {"recording": {"folder": "elsewhere"}}, Path())
    assert elsewhere.digest() == default_plan.digest()


def test_values_of_the_command_line_are_checked_like_those_of_a_plan_file(default_plan: Plan) -> None:
    with pytest.raises(PlanError, match="duration"):
        with_test(default_plan, duration=-3.0)


def reality_of(default_plan: Plan, tmp_path: Path, text: str) -> reality.Reality:
    path = tmp_path / "reality.toml"
    path.write_text(text)
    return reality.load(path, default_plan)


def test_a_reality_changes_only_the_keys_that_it_gives(default_plan: Plan, tmp_path: Path) -> None:
    found = reality_of(
        default_plan,
        tmp_path,
        "seed = 7\n[structure]\nstiffness = 26.5e6\n[actuator]\ndelay = 0.015\n"
        "[master.rig]\nclass = 'lab.py:Lab'\noptions = { a = 1.0 }\n[link]\nclass = 'p.q:Link'\n",
    )
    assert found.seed == 7
    assert found.plan.structure.stiffness == (26.5e6,)
    assert found.plan.actuator.delay == 0.015
    assert found.plan.column == default_plan.column
    assert found.master.class_ == f"{tmp_path.resolve()}/lab.py:Lab"
    assert found.master.options == {"a": 1.0}
    assert found.slave.class_ == ""
    assert found.link.class_ == "p.q:Link"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[colum]\n", "did you mean column"),
        ("seed = -1\n", "seed is -1"),
        ("[structure]\nstiffness = 'a'\n", "must be a number"),
        ("[[effect]]\nforce = 900.0\n", "give a name"),
        ("[", "not valid TOML"),
    ],
)
def test_a_wrong_reality_is_refused(default_plan: Plan, tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(PlanError, match=message):
        reality_of(default_plan, tmp_path, text)
