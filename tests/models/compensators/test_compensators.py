"""Compensators against the transfer functions of their papers."""

from __future__ import annotations

import numpy as np
import pytest

from common.errors import InputError
from models import compensators
from models.compensators import COMPENSATORS
from tests.models.compensators.rig import DT, GAINS, L, T, ask, delay, drive, response, sine, theory

PLANT = {"delay": L, "time_constant": T}
TYPICAL: dict[str, dict[str, float]] = {
    "none": {},
    "pid": GAINS,
    "taylor": {"lead": 0.044, "order": 2},
    "pid_taylor": {**GAINS, "lead": 0.044},
    "horiuchi": {"delay": 0.044, "order": 3},
    "inverse": PLANT,
    "pid_inverse": {**GAINS, **PLANT},
    "ats": {},
    "pi_lead": {},
    "series": {"a0": 1.0},
    "amb": {"a0": 1.0},
}
FEEDFORWARD = [kind for kind in COMPENSATORS if kind != "pi_lead"]  # which commands nothing without an error


@pytest.mark.parametrize("frequency", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("none", {}),
        ("pid", GAINS),
        ("pid", {**GAINS, "integral": 2.0, "derivative": 0.01}),
        *(("taylor", {"lead": 0.044, "order": order}) for order in (1, 2, 3)),
        ("pid_taylor", {**GAINS, "lead": 0.0088}),
        *(("pid_taylor", {**GAINS, "lead": 0.044, "order": order}) for order in (1, 2, 3)),
        *(("horiuchi", {"delay": 0.044, "order": order}) for order in (1, 2, 3)),
        ("horiuchi", {"delay": 0.0433, "order": 3}),
        *(("inverse", {**PLANT, "order": order}) for order in (1, 2, 3)),
        *(("pid_inverse", {**GAINS, **PLANT, "order": order}) for order in (1, 2, 3)),
    ],
)
def test_residual_delay_and_amplitude_agree_with_theory(
    kind: str, parameters: dict[str, float], frequency: float
) -> None:
    got = response(drive(kind, parameters, sine(frequency), 5000), frequency)
    expected = theory(kind, parameters, frequency)
    assert delay(got, frequency) == pytest.approx(delay(expected, frequency), abs=2e-5)
    assert abs(got) == pytest.approx(abs(expected), abs=5e-4)


def test_the_residual_delays_agree_with_the_seed_paper() -> None:
    """Figures quoted in the paper and derived in the docstring of `pid_taylor`."""
    cases: list[tuple[dict[str, float], float]] = [({"lead": 0.0}, 0.044 / 2.93), ({"lead": 0.044}, 0.0)]
    for lead, expected in cases:
        got = response(drive("pid_taylor", GAINS | lead, sine(1.0), 5000), 1.0)
        assert delay(got, 1.0) == pytest.approx(expected, abs=0.0015)


@pytest.mark.parametrize("kind", FEEDFORWARD)
@pytest.mark.parametrize("target", [0.5, -0.003, 0.0])
def test_a_constant_target_is_commanded_unchanged(kind: str, target: float) -> None:
    built = compensators.build(kind, TYPICAL[kind], DT)
    got = [ask(built, target, present=target, measured=target) for _ in range(1200)]
    assert got == pytest.approx(np.full(1200, target), rel=1e-13)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_taylor_is_exact_for_polynomials_of_its_order(order: int) -> None:
    lead = 0.0437
    polynomial = np.polynomial.Polynomial([0.3, -1.2, 5.0, -70.0][: order + 1])
    built = compensators.build("taylor", {"lead": lead, "order": order}, DT)
    for time in (0.0, 0.11, 0.5):
        derivatives = [float(polynomial.deriv(j)(time)) for j in range(4)]
        assert ask(built, *derivatives) == pytest.approx(polynomial(time + lead), rel=1e-12)


def test_pid_taylor_is_first_order_by_default() -> None:
    built = compensators.build("pid_taylor", {**GAINS, "lead": 0.1}, DT)
    assert ask(built, 1.0, 2.0, 3.0, 4.0) == 1.0 + 0.1 * 2.0
    built = compensators.build("pid_taylor", {**GAINS, "lead": 0.1, "order": 3}, DT)
    expected = 1.0 + 0.1 * 2.0 + 0.005 * 3.0 + 0.001 / 6.0 * 4.0
    assert ask(built, 1.0, 2.0, 3.0, 4.0) == pytest.approx(expected, rel=1e-15)


def test_the_pid_terms_agree_with_equation_3() -> None:
    built = compensators.build("pid", {"proportional": 2.0, "integral": 3.0, "derivative": 0.5}, DT)
    errors = [0.0, 0.1, 0.3, 0.2]
    got = [ask(built, 1.0, present=error) for error in errors]
    integral = np.concatenate([[0.0], np.cumsum(DT * 0.5 * np.add(errors[1:], errors[:-1]))])
    slopes = np.diff(errors, prepend=0.0) / DT
    assert got == pytest.approx(1.0 + 2.0 * np.array(errors) + 3.0 * integral + 0.5 * slopes)


@pytest.mark.parametrize("kind", COMPENSATORS)
def test_every_kind_has_a_rule_for_each_parameter_and_its_own_code(kind: str) -> None:
    method = COMPENSATORS[kind]
    assert set(method.rules) == set(method.params._fields)
    assert [other.code for other in COMPENSATORS.values()].count(method.code) == 1


@pytest.mark.parametrize("kind", COMPENSATORS)
def test_unknown_parameters_are_refused_with_the_nearest_name(kind: str) -> None:
    with pytest.raises(InputError, match=f"Unknown parameter 'zzz' of compensator '{kind}'"):
        compensators.build(kind, {**TYPICAL[kind], "zzz": 1.0}, DT)
    for name in COMPENSATORS[kind].params._fields:
        with pytest.raises(InputError, match=f"'{name}x' of compensator '{kind}'.*did you mean {name}"):
            compensators.build(kind, {**TYPICAL[kind], name + "x": 1.0}, DT)


def test_unknown_kinds_are_refused_with_the_nearest_name() -> None:
    for wrong, right in [("tailor", "taylor"), ("horiuchy", "horiuchi"), ("invers", "inverse")]:
        with pytest.raises(InputError, match=f"did you mean {right}"):
            compensators.build(wrong, {}, DT)


@pytest.mark.parametrize("kind", COMPENSATORS)
def test_missing_parameters_are_refused(kind: str) -> None:
    method = COMPENSATORS[kind]
    for name in method.params._fields:
        if name not in method.params._field_defaults:
            rest = {other: value for other, value in TYPICAL[kind].items() if other != name}
            with pytest.raises(InputError, match=f"Parameter '{name}' of compensator '{kind}'.* is missing"):
                compensators.build(kind, rest, DT)


@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for kind, method in COMPENSATORS.items() for name in method.rules]
)
def test_values_out_of_range_are_refused(kind: str, name: str) -> None:
    rule = COMPENSATORS[kind].rules[name]
    bad = [float("nan"), float("inf")]
    bad += [bound - 1e-3 for bound in (rule.least, rule.above) if bound is not None]
    bad += [rule.most + 1e-3] if rule.most is not None else []
    bad += [rule.above] if rule.above is not None else []
    bad += [1.5] if name == "order" else []
    for value in bad:
        with pytest.raises(InputError, match=f"{name}'? of compensator '{kind}'.* must be"):
            compensators.build(kind, {**TYPICAL[kind], name: value}, DT)


def test_pid_and_pid_taylor_equal_the_plain_expressions_to_the_last_bit() -> None:
    rng = np.random.default_rng(5)
    P, I, D, lead = 1.93, 0.047, 0.003, 0.0088  # noqa: E741
    gains = {"proportional": P, "integral": I, "derivative": D}
    plain = compensators.build("pid", gains, DT)
    ahead = compensators.build("pid_taylor", {**gains, "lead": lead}, DT)
    integral, before = 0.0, 0.0
    for r, rate, bend, jerk, present, measured in rng.normal(size=(500, 6)).tolist():
        error = present - measured
        integral += 0.5 * DT * (before + error)
        slope = (error - before) / DT
        before = error
        expected = r + P * error + I * integral + D * slope
        assert ask(plain, r, rate, bend, jerk, present, measured) == expected
        expected = (r + lead * rate) + P * error + I * integral + D * slope
        assert ask(ahead, r, rate, bend, jerk, present, measured) == expected
