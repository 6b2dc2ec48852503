"""Saddle points of pictures whose every value is known in closed form."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets import saddles
from rig.targets.saddles import bilinear, find_saddles

ANGLES = np.arange(16) * (2 * np.pi / 16)


def quadratic(
    xx: float, xy: float, yy: float, x0: float = 0.0, y0: float = 0.0
) -> NDArray[np.float32]:
    """Grey levels (9, 11) of a second-order surface about (5 + x0, 4 + y0)."""
    y, x = np.mgrid[:9, :11].astype(np.float64)
    x, y = x - 5 - x0, y - 4 - y0
    return (xx / 2 * x * x + xy * x * y + yy / 2 * y * y).astype(np.float32)


def ring(first_rad: float, second_rad: float, *, half: float = 50.0) -> Float:
    """(1, 16) samples around the crossing of two blurred edges, bright where both sines agree."""
    first, second = np.tanh(4 * np.sin(ANGLES - np.array([[first_rad], [second_rad]])))
    return 100 + half * (first * second)[None]


def test_bilinear_is_exact_for_what_is_linear_in_each_direction() -> None:
    y, x = np.mgrid[:5, :7].astype(np.float32)
    picture = 3 + 2 * x - 5 * y + 7 * x * y
    at = np.array([[0.25, 0.75], [5.5, 3.25], [6.0, 4.0], [0.0, 0.0], [2.0, 3.0]])
    expected = 3 + 2 * at[:, 0] - 5 * at[:, 1] + 7 * at[:, 0] * at[:, 1]
    assert bilinear(picture, at) == pytest.approx(expected, rel=1e-12)


def test_bilinear_takes_the_four_pixels_around() -> None:
    picture = np.array([[1, 10, 100, 7], [1000, 10000, 3, 5], [2, 4, 8, 16]], np.float32)
    at = np.array([[[0.25, 0.5], [2.75, 1.25]], [[3.0, 2.0], [1.0, 1.0]]])
    assert bilinear(picture, at).tolist() == [
        [(0.75 + 2.5 + 750 + 2500) / 2, 0.75 * (0.25 * 3 + 0.75 * 5) + 0.25 * (2 + 12)],
        [16.0, 10000.0],
    ]


def test_second_derivatives_are_those_of_the_surface() -> None:
    at = np.array([4, 3]), np.array([5, 7])
    found = saddles._hessian(quadratic(3.0, -2.0, 5.0), *at)
    assert found == pytest.approx(np.array([[3.0] * 2, [-2.0] * 2, [5.0] * 2]))


@pytest.mark.parametrize(("xx", "xy", "yy"), [(0.0, 4.0, 0.0), (3.0, -2.0, -5.0), (-1.0, 3.0, 2.0)])
@pytest.mark.parametrize(("x0", "y0"), [(0.25, -0.5), (-0.75, 0.125)])
def test_the_middle_is_where_the_gradient_vanishes(
    xx: float, xy: float, yy: float, x0: float, y0: float
) -> None:
    at = np.array([4]), np.array([5])
    picture = quadratic(xx, xy, yy, x0, y0)
    beside = saddles._beside_pixel(picture, *at, saddles._hessian(picture, *at))
    assert beside == pytest.approx(np.array([[x0, y0]]), abs=1e-5)


def test_the_middle_is_never_farther_than_a_pixel() -> None:
    at = np.array([4]), np.array([5])
    picture = quadratic(0.0, 4.0, 0.0, 1.75, -1.5)
    beside = saddles._beside_pixel(picture, *at, saddles._hessian(picture, *at))
    assert beside.tolist() == [[1.0, -1.0]]


@pytest.mark.parametrize("half", [50.0, -50.0])
@pytest.mark.parametrize(("first_deg", "second_deg"), [(10.0, 100.0), (33.0, 98.0), (80.0, 185.0)])
def test_a_ring_tells_edges_and_the_bright_side(
    first_deg: float, second_deg: float, half: float
) -> None:
    first, second = np.radians([first_deg, second_deg])
    axes, bright = saddles._directions(ring(first, second, half=half))
    found = np.arctan2(axes[0, :, 1], axes[0, :, 0]) % np.pi
    wanted = np.array([first, second]) % np.pi
    # Samples are joined by straight lines and the middle is that of 16 samples.
    assert np.sort(found) == pytest.approx(np.sort(wanted), abs=0.03)
    # Both sines agree between the second edge and the first one's other end.
    towards = (first + second) / 2 + (np.pi / 2 if half > 0 else 0.0)
    assert bright[0] == pytest.approx([np.cos(2 * towards), np.sin(2 * towards)], abs=0.05)
    assert np.hypot(*axes[0].T) == pytest.approx([1.0, 1.0], abs=1e-12)


def test_rings_pass_only_with_four_quadrants_alike_after_half_a_turn() -> None:
    good = ring(0.1, 0.1 + np.pi / 2)[0]
    two = 100 + 25 * np.sin(ANGLES)
    six = 100 + 25 * np.sin(3 * ANGLES + 0.1)
    flat = np.full(16, 100.0)
    kept, contrast = saddles._ring_test(np.stack([good, two, six, flat]))
    assert kept.tolist() == [True, False, False, False]
    assert contrast == pytest.approx([np.ptp(good), 50.0, np.ptp(six), 0.0])


@pytest.mark.parametrize(("uneven", "is_kept"), [(0.34, True), (0.36, False)])
def test_a_ring_may_differ_by_a_third_after_half_a_turn(uneven: float, is_kept: bool) -> None:
    levels = np.array([0.0] * 4 + [1.0] * 4 + [uneven] * 4 + [1.0] * 4)
    levels[12:] = 1.0 - uneven
    kept, contrast = saddles._ring_test(levels[None])
    assert contrast.tolist() == [1.0]
    assert kept.tolist() == [is_kept]


def test_the_strongest_come_first_and_weak_ones_are_left_out() -> None:
    strength = np.zeros((40, 60), np.float32)
    for row, column, value in [(10, 20, 50.0), (20, 40, 90.0), (30, 11, 0.9), (29, 50, 0.89)]:
        strength[row, column] = value
    strength[12, 22] = 49.0  # within the 5 x 5 pixels of a stronger one
    strength[13, 19] = 48.0  # just outside of them
    strength[4, 30] = 70.0  # on the border
    strength[36, 30] = 71.0
    row, column = saddles._strongest(strength, border=5, least=0.0)
    # Less than a hundredth of the last of the twenty strongest, here of all.
    assert list(zip(row.tolist(), column.tolist(), strict=True)) == [
        (20, 40), (10, 20), (13, 19), (30, 11), (29, 50),
    ]  # fmt: skip
    assert saddles._strongest(strength[:10], border=5, least=0.0)[0].size == 0
    inside, _ = saddles._strongest(strength[:35, :25], border=4, least=0.0)
    assert inside.tolist() == [10, 13, 30]


def test_responses_below_a_hundredth_of_the_twenty_first_are_not_looked_at() -> None:
    strength = np.zeros((16, 260), np.float32)
    values = [1000.0] * 20 + [100.0] + [1.01, 1.0, 0.99]
    for place, value in enumerate(values):
        strength[8, 10 + 10 * place] = value
    _, column = saddles._strongest(strength, border=4, least=0.0)
    assert len(column) == 22
    assert sorted(column.tolist()) == list(range(10, 230, 10))


def test_no_more_than_four_hundred_are_looked_at() -> None:
    strength = np.zeros((110, 110), np.float32)
    strength[5:105:4, 5:105:4] = np.arange(1000, 1625, dtype=np.float32).reshape(25, 25)
    row, column = saddles._strongest(strength, border=5, least=0.0)
    assert len(row) == saddles.MAX_SADDLES == 400
    assert (row[0], column[0]) == (101, 101)
    assert strength[row, column].min() == 1225.0


@pytest.mark.parametrize("turn_deg", [0.0, 30.0])
def test_one_crossing_is_found_with_place_axes_side_and_contrast(turn_deg: float) -> None:
    fine, place = 5, np.array([21.3, 16.8])
    y, x = (np.mgrid[: 36 * fine, : 44 * fine] + 0.5) / fine - 0.5
    angle = np.radians(turn_deg)
    along = np.cos(angle) * (x - place[0]) + np.sin(angle) * (y - place[1])
    across = np.cos(angle) * (y - place[1]) - np.sin(angle) * (x - place[0])
    sharp = np.where(along * across > 0, 200.0, 40.0).astype(np.float32)
    picture = cv2.resize(sharp, (44, 36), interpolation=cv2.INTER_AREA)
    found = find_saddles(np.asarray(picture, np.float32), smooth_px=1.0, ring_px=3.5)
    assert len(found) == 1
    assert found.xy_px[0] == pytest.approx(place, abs=0.15)
    axis = np.arctan2(found.axes[0, :, 1], found.axes[0, :, 0]) % (np.pi / 2)
    assert np.sin(axis - angle) == pytest.approx([0.0, 0.0], abs=0.05)
    bright = 2 * (angle + np.pi / 4)
    assert found.bright[0] == pytest.approx([np.cos(bright), np.sin(bright)], abs=0.04)
    assert found.contrast[0] == pytest.approx(155.0, abs=6.0)


def test_a_crossing_whose_ring_leaves_the_picture_is_not_found() -> None:
    y, x = np.mgrid[:30, :30]
    for column, count in ((3, 0), (4, 1), (24, 1), (25, 0)):
        grey = np.where((x > column) == (y > 15), 200, 40).astype(np.float32)
        assert len(find_saddles(grey, smooth_px=1.0, ring_px=3.5)) == count


def test_the_rounding_of_a_straight_edge_is_no_saddle() -> None:
    assert saddles._strongest(np.full((16, 16), 0.5, np.float32), border=4, least=0.5)[0].size == 0
    # All alike: none is exceeded.
    assert saddles._strongest(np.full((16, 16), 0.6, np.float32), border=4, least=0.5)[0].size == 64
    y, x = np.mgrid[:40, :60]
    for turn in (0.0, 0.3, 1.1):
        grey = np.where(x * np.cos(turn) + y * np.sin(turn) > 30, 200.0, 40.0).astype(np.float32)
        assert len(find_saddles(grey, smooth_px=1.0, ring_px=3.5)) == 0
