"""Turns, their logarithm, and the derivative of a Rodrigues vector."""

import numpy as np
import pytest

from rig.geometry.bundle.rotations import rodrigues_by_turn, turn_between, turns
from rig.geometry.pose import Pose
from tests.support.calibration_scene import turn

VECTORS = [(0.0, 0.0, 0.0), (1e-7, -2e-7, 1e-7), (0.3, -0.2, 0.5), (-1.0, 2.0, 1.2)]


@pytest.mark.parametrize("vector", VECTORS)
def test_a_turn_is_the_rotation_of_its_vector_and_back(vector: tuple[float, float, float]):
    rotation = turns(np.array([vector]))[0]
    assert rotation == pytest.approx(turn(np.degrees(vector)), abs=1e-12)
    base = turn((20.0, -70.0, 50.0))
    assert turn_between(rotation @ base, base) == pytest.approx(vector, abs=1e-12)


@pytest.mark.parametrize("vector", VECTORS)
def test_the_rodrigues_vector_moves_with_a_turn_as_the_derivative_says(
    vector: tuple[float, float, float],
):
    rotation = turn(np.degrees(vector))

    def after(small: np.ndarray) -> np.ndarray:
        return Pose(turns(small) @ rotation, np.zeros(3)).rotation_rad

    step = 1e-6 * np.eye(3)
    quotient = np.stack([(after(s) - after(-s)) / 2e-6 for s in step], axis=1)
    assert rodrigues_by_turn(np.array(vector)) == pytest.approx(quotient, abs=1e-8)
