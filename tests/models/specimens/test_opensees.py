"""The columns against OpenSees's uniaxial materials, where OpenSeesPy is installed and loads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from models import specimens
from models.registry import Array
from models.specimens import layered

K, DY = 12.5, 8.0  # kN/mm, mm: OpenSees's local iteration has an absolute tolerance
CORNERS = np.array([0.0, 2.0, -1.0, 0.7, -3.0, 4.0, 3.5, 3.8, -0.2, 5.0, -5.0]) * DY


@pytest.fixture(name="ops")
def _ops() -> Iterator[Any]:
    try:
        ops = import_module("openseespy.opensees")
    except (ImportError, RuntimeError, OSError) as why:
        pytest.skip(f"OpenSeesPy does not load here: {why}")
    ops.wipe()
    yield ops
    with suppress(Exception):
        ops.wipe()


def path(steps: int) -> Array:
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(CORNERS)]
    return np.concatenate(parts)


def theirs(ops: Any, deformations: Array, *material: float | str) -> Array:
    ops.uniaxialMaterial(material[0], 1, *material[1:])
    ops.testUniaxialMaterial(1)
    force = []
    for x in deformations:
        ops.setStrain(float(x))
        force.append(ops.getStress())
    return np.array(force)


def ours(name: str, deformations: Array, **params: float) -> Array:
    kind, p, s = specimens.pack(name, **{"stiffness": K, "yield_displacement": DY, **params})
    return np.array([specimens.step(kind, p, s, float(x)) for x in deformations])


@pytest.mark.parametrize("hardening", [0.0, 0.05, 0.3])
def test_bilinear_equals_steel01(ops: Any, hardening: float) -> None:
    points = path(200)
    expected = theirs(ops, points, "Steel01", K * DY, K, hardening)
    np.testing.assert_allclose(
        ours("bilinear", points, hardening=hardening), expected, rtol=0, atol=1e-9 * K * DY
    )


@pytest.mark.parametrize("sharpness", [5.0, 20.0])
def test_menegotto_and_pinto_equals_steel02(ops: Any, sharpness: float) -> None:
    points = path(200)
    expected = theirs(ops, points, "Steel02", K * DY, K, 0.05, sharpness, 0.925, 0.15)
    found = ours("menegotto_pinto", points, hardening=0.05, sharpness=sharpness)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * K * DY)


@pytest.mark.parametrize("n", [1.0, 2.0, 4.0])
@pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (0.8, 0.2), (0.3, 0.7)])
def test_bouc_wen_equals_that_of_opensees(ops: Any, n: float, beta: float, gamma: float) -> None:
    # theirs has units of m⁻ⁿ and integrates by backward Euler, of order 1 in the step
    points = path(4000)
    unit = DY**-n
    expected = theirs(
        ops, points, "BoucWen", 0.05, K, n, gamma * unit, beta * unit, 1.0, 0.0, 0.0, 0.0, 1e-10, 200
    )
    found = ours("bouc_wen", points, hardening=0.05, n=n, beta=beta, gamma=gamma)
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-3 * K * DY)


@pytest.mark.parametrize(
    ("force", "place", "unloading", "asymmetry"),
    [
        (1.0, 1.0, 0.0, 0.0),
        (0.3, 0.6, 0.0, 0.0),
        (0.5, 0.4, 0.3, 0.0),
        (0.3, 0.6, 0.0, -0.4),
        (1.0, 1.0, 0.3, 0.6),
    ],
)
def test_pinched_equals_hysteretic(
    ops: Any, force: float, place: float, unloading: float, asymmetry: float
) -> None:
    # theirs ends in a third point, beyond which its last line goes on
    points, first, last = path(2000), 0.5, 40.0
    bend, yields = first * K * DY, (first + 0.5 * 0.4) * K * DY
    corners = [bend, first * DY, yields, DY, yields + 0.05 * K * (last - 1.0) * DY, last * DY]
    sides = 1.0 + asymmetry, asymmetry - 1.0
    skeleton = [side * corner for side in sides for corner in corners]
    expected = theirs(ops, points, "Hysteretic", *skeleton, place, force, 0.0, 0.0, unloading)
    found = ours(
        "pinched",
        points,
        hardening=0.05,
        first_bend=first,
        second_stiffness=0.4,
        pinch_force=force,
        pinch_displacement=place,
        unloading=unloading,
        asymmetry=asymmetry,
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-3 * K * DY)


def test_pinched_by_peak_equals_pinching4(ops: Any) -> None:
    # theirs has a fourth line, which is here as steep as the third
    points, force, place, hardening = path(400), 0.3, 0.5, 0.05
    bend, yields = 0.5 * K * DY, 0.8 * K * DY
    farther = [x for far in (2.0, 40.0) for x in (yields + hardening * K * far * DY, (1.1 + far) * DY)]
    skeleton = [bend, 0.5 * DY, yields, 1.1 * DY, *farther]
    expected = theirs(ops, points, "Pinching4", *skeleton, place, force, 0.0, *[0.0] * 15, 10.0, "energy")
    found = ours(
        "pinched_by_peak",
        points,
        yield_displacement=1.1 * DY,
        hardening=hardening,
        first_bend=0.5 / 1.1,
        second_stiffness=0.5,
        pinch_force=force,
        pinch_displacement=place,
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * K * DY)


def test_pinched_by_rest_equals_the_hinge_of_ibarra_medina_and_krawinkler(ops: Any) -> None:
    # theirs drops to no force for ever at some partial unloadings, so that this path has none; its cap and its energy
    # to failure are far away
    points, hardening, force, place = path(400)[:2000], 0.05, 0.3, 0.5
    yields, far = K * DY, [50.0 * DY] * 4
    fate = [1e9] * 4 + [1.0] * 4 + far + [0.2, 0.2, 400.0 * DY, 400.0 * DY, 1.0, 1.0]
    rules = [hardening, hardening, yields, -yields, force, force, place]
    expected = theirs(ops, points, "ModIMKPinching", K, *rules, *fate)
    found = ours("pinched_by_rest", points, hardening=hardening, pinch_force=force, pinch_displacement=place)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * K * DY)


def section_moments(ops: Any, curvatures: Array, more: dict[str, float]) -> Array:
    """Moments of the section of `layered` with OpenSees' materials, in units of the bars' yield stress and strain."""
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.uniaxialMaterial("Steel02", 1, 1.0, 1.0, layered.BARS_HARDEN, more["sharpness"], 0.925, 0.15)
    strength, layers = more["strength"], 2 * layered.HALF
    for tag, spalling in ((2, more["core"] * more["spalling"]), (3, more["spalling"])):
        left, end = layered.LEFT * strength, 2.0 * strength + (1.0 - layered.LEFT) / spalling
        ratio = (more["focus"] + left) / (more["focus"] + end)  # with which their common point is that focus
        ops.uniaxialMaterial("Concrete02", tag, -strength, -2.0 * strength, -left, -end, ratio, 1e-9, 1.0)
    ops.section("Fiber", 1)
    for i in range(layers):
        cover = i in (0, layers - 1)
        ops.fiber((i + 0.5) / layers - 0.5, 0.0, more["concrete"] / layers, 3 if cover else 2)
    for y in (-layered.BAR, 0.0, layered.BAR):
        ops.fiber(y, 0.0, 0.5 * (1.0 - layered.MIDDLE) if y else layered.MIDDLE, 1)
    for node, rotates in ((1, 1), (2, 0)):
        ops.node(node, 0.0, 0.0)
        ops.fix(node, rotates, 1, rotates)
    ops.element("zeroLengthSection", 1, 1, 2, 1)
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(2, -more["axial"], 0.0, 0.0)
    ops.test("NormUnbalance", 1e-8, 200)
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static", "-noWarnings")
    assert ops.analyze(1) == 0
    ops.loadConst("-time", 0.0)
    ops.timeSeries("Linear", 2)
    ops.pattern("Plain", 2, 2)
    ops.load(2, 0.0, 0.0, 1.0)
    result = []
    for moved in np.diff(curvatures, prepend=0.0):
        ops.integrator("DisplacementControl", 2, 3, float(moved))
        assert ops.analyze(1) == 0
        result.append(ops.getTime())
    return np.array(result)


@pytest.mark.parametrize(
    ("axial", "focus", "core", "rms"),
    [(0.4, 2.0, 0.1, 0.015), (1.0, 2.0, 0.1, 0.03), (0.1, 5.0, 0.1, 0.005), (0.4, 2.0, 0.8, 0.015)],
)
def test_layered_follows_a_fibre_section_of_concrete02_and_steel02(
    ops: Any, axial: float, focus: float, core: float, rms: float
) -> None:
    # theirs reloads concrete along two lines in the place of one
    more = {"concrete": 5.0, "axial": axial, "strength": 0.5, "spalling": 0.15, "focus": focus, "core": core}
    more |= {"sharpness": 18.0, "shaft": 0.6}
    corners = np.array([0.0, 2.0, -2.0, 4.0, -4.0, 1.0, 8.0, -3.0, -1.0, -8.0, 8.0, 0.0]) * 2.0
    curvatures = np.concatenate([np.linspace(a, b, 401)[1:] for a, b in pairwise(corners)])
    params = layered.LayeredParams(K, DY, **more)
    bending = layered.at_rest(np.array(params))[1]
    expected = K * DY * layered.BAR / bending * section_moments(ops, curvatures, more)
    points = (1.0 - params.shaft) * DY * layered.BAR * curvatures + params.shaft * expected / K
    wrong = ours("layered", points, **more) - expected
    assert np.sqrt(np.mean(wrong**2) / np.mean(expected**2)) < rms
    assert np.max(np.abs(wrong)) < 0.05 * np.max(np.abs(expected))


def test_trilinear_equals_a_sum_of_steel01(ops: Any) -> None:
    points, bend, second, hardening = path(200), 0.4, 0.5, 0.05
    ops.uniaxialMaterial("Steel01", 2, (1.0 - second) * K * bend * DY, (1.0 - second) * K, 0.0)
    ops.uniaxialMaterial("Steel01", 3, (second - hardening) * K * DY, (second - hardening) * K, 0.0)
    ops.uniaxialMaterial("Elastic", 4, hardening * K)
    expected = theirs(ops, points, "Parallel", 2, 3, 4)
    found = ours("trilinear", points, hardening=hardening, first_bend=bend, second_stiffness=second)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * K * DY)


@pytest.mark.parametrize("loop", [0.3, 0.9])
def test_self_centring_equals_that_of_opensees(ops: Any, loop: float) -> None:
    # theirs leaves a line up to one increment late
    points = path(2000)
    expected = theirs(ops, points, "SelfCentering", K, 0.1 * K, K * DY, loop)
    found = ours("self_centring", points, hardening=0.1, loop=loop)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-3 * K * DY)


def test_degradation_equals_that_of_opensees(ops: Any) -> None:
    # their energy is k·∫z dx over lengths, ours over k·δ_y²
    points, n, rate = path(4000), 2.0, 1.0 / (K * DY**2)
    unit = DY**-n
    expected = theirs(
        ops,
        points,
        *("BoucWen", 0.05, K, n, 0.5 * unit, 0.5 * unit, 1.0, 0.0, 0.05 * rate, 0.1 * rate, 1e-10, 200),
    )
    found = ours("bwbn", points, hardening=0.05, n=n, delta_nu=0.05, delta_eta=0.1, zeta_s=0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-3 * K * DY)
