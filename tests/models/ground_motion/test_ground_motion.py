import dataclasses

import numpy as np
import pytest

from models.ground_motion import STANDARD_GRAVITY, GroundMotion


def motion() -> GroundMotion:
    return GroundMotion("Here", "file here.csv", 0.02, STANDARD_GRAVITY * np.array([0.0, 0.1, -0.31882, 0.2]))


def test_the_properties_follow_from_the_samples() -> None:
    assert motion().points == 4
    assert motion().peak == pytest.approx(0.31882 * STANDARD_GRAVITY)
    assert motion().duration == pytest.approx(0.06)


def test_the_description_distinguishes_versions_of_a_record() -> None:
    assert motion().describe() == "Here (file here.csv), dt 0.02 s, 4 points, PGA 0.3188 g"
    assert (
        motion().scaled(0.1).describe()
        == "Here (file here.csv, scaled by 0.1), dt 0.02 s, 4 points, PGA 0.03188 g"
    )


def test_scaling_does_not_change_the_original_motion() -> None:
    original = motion()
    scaled = original.scaled(-2.0)
    np.testing.assert_array_equal(scaled.acceleration, -2.0 * original.acceleration)
    assert (scaled.interval, scaled.name) == (original.interval, original.name)
    assert original.scaled(1.0).describe() == original.describe()


def test_a_ground_motion_is_immutable() -> None:
    samples = np.array([1.0, 2.0])
    fixed = GroundMotion("Here", "test", 0.02, samples)
    samples[0] = 9.0
    assert fixed.acceleration[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        fixed.acceleration[0] = 9.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        fixed.name = "There"  # type: ignore[misc]
