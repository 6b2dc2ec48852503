"""The model of two crossing edges and the markers beside them."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from rig.arrays import Float
from rig.targets.crossing import BLUR, HALF, PARAMETERS, Markers, crossing_model

OFFSET = np.stack(np.meshgrid(np.arange(-7.0, 8.0), np.arange(-7.0, 8.0)), axis=-1).reshape(-1, 2)
MARKERS = Markers(
    np.full((1, 2), 2.5),
    np.full((1, 2), 2.0),
    np.array([[0.1, -0.2]]),
    np.array([[0.01, 0.02]]),
)


def value(*, between_deg: float = 80.0, half: float = 70.0) -> Float:
    return np.array([[0.2, -0.3, 0.3, 0.3 + np.radians(between_deg), 0.9, 110.0, half]])


def grey(at: Float, markers: Markers | None) -> Float:
    return crossing_model(OFFSET, at, markers)[0][0]


@pytest.mark.parametrize("markers", [None, MARKERS], ids=["bare", "markers"])
@pytest.mark.parametrize("half", [70.0, -70.0])
def test_derivatives_are_those_of_the_model(markers: Markers | None, half: float):
    at = value(half=half)
    _, jacobian, _ = crossing_model(OFFSET, at, markers)
    for column in range(PARAMETERS):
        step = np.zeros_like(at)
        step[0, column] = 0.01
        change = (grey(at + step, markers) - grey(at - step, markers)) / 0.02
        # The margin's own growth along an edge is left out of the derivatives: it is that small.
        assert jacobian[0, column] == pytest.approx(change, abs=0.03 * np.abs(change).max())


@pytest.mark.parametrize("between_deg", [90.0, 80.0, 105.0])
def test_edges_at_a_slant_are_blurred_as_the_normal_integral_says(between_deg: float):
    at = value(between_deg=between_deg)
    x, y = (OFFSET - at[0, :2]).T
    first, second = ((-np.sin(angle) * x + np.cos(angle) * y) / at[0, BLUR] for angle in at[0, 2:4])
    rho = np.cos(np.radians(between_deg))
    both = multivariate_normal([0.0, 0.0], [[1.0, rho], [rho, 1.0]]).cdf(
        np.stack([first, second], axis=-1)
    )
    product = 4 * both - 2 * norm.cdf(first) - 2 * norm.cdf(second) + 1
    assert grey(at, None) == pytest.approx(110.0 + at[0, HALF] * product, abs=0.15)


def test_markers_are_black_in_the_bright_quadrants_only():
    bare, marked = grey(value(), None), grey(value(), MARKERS)
    assert marked.min() == pytest.approx(40.0, abs=0.1)
    changed = np.abs(marked - bare) > 1.0
    assert 20 < changed.sum() < len(changed) / 2
    assert bare[changed].min() > 110.0
    assert np.all(marked[changed] < bare[changed])


def test_the_bits_within_markers_count_for_nothing():
    _, _, known = crossing_model(OFFSET, value(), MARKERS)
    first, second = ((OFFSET - (0.2, -0.3)) @ normal for normal in _normals())
    deep = (np.abs(first) > 4.5) & (np.abs(second) > 4.5) & (first * second > 0)
    dark = first * second < 0
    assert deep.sum() > 8
    assert np.all(known[0, deep] == 0)
    assert np.all(known[0, dark & (np.hypot(first, second) < 5)] == 1)


def _normals() -> list[Float]:
    return [np.array([-np.sin(angle), np.cos(angle)]) for angle in value()[0, 2:4]]
