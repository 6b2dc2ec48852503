"""Patches: where they are put, and one Gauss-Newton fit beside plain moments of arrays."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.mending.patches import (
    BORDER_PX,
    Patches,
    directions,
    distinctness,
    find_patches,
    most_distinct,
    most_distinct_near,
)
from tests.support.lightfield import noise_texture

Map = NDArray[np.float64]
RNG = np.random.default_rng(31)
SHAPE = (46, 58)
ROWS, COLUMNS = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)
TEXTURE = noise_texture(5, mean=110.0, contrast=30.0, finest_px=4.0)
REFERENCE = TEXTURE(COLUMNS, ROWS).astype(np.float32)
STEPS = (-1.5, 0.8)


def test_directions_are_unit_vectors_along_the_line_and_across_it():
    along, across = directions(-3.0, 4.0)
    assert along == pytest.approx([-0.6, 0.8])
    assert across == pytest.approx([-0.8, -0.6])


def test_places_on_the_line_leave_out_what_lies_across_it():
    found = Patches(
        np.array([10, 20]), np.array([5, 6]), np.array([5.0, -10.0]), np.array([7.0, 8.0]),
        np.array([0.1, 0.2]),
    )  # fmt: skip
    columns, rows = found.on_line_px((-3.0, 4.0))
    assert columns == pytest.approx([7.0, 26.0])
    assert rows == pytest.approx([9.0, -2.0])
    last = found[np.array([False, True])]
    assert [one.tolist() for one in (last.columns, last.rows, last.along_px, last.across_px)] == [
        [20], [6], [-10.0], [8.0],
    ]  # fmt: skip
    assert last.sigma_px.tolist() == [0.2]


def test_distinctness_is_that_of_a_patch_of_eleven_pixels():
    step = np.zeros((31, 31), np.float32)
    step[15:, 15:] = 50.0
    strength = distinctness(step)
    reached = np.argwhere(strength > 1e-6)
    # Both of its edges must lie in the window, and Sobel looks a pixel further.
    assert reached.min() == 9
    assert strength[15, 15] > strength[11, 15] > 0
    assert strength[3, 15] == 0


@pytest.mark.parametrize("cell_px", [4, 7])
def test_each_cell_gives_its_most_distinct_pixel(cell_px: int):
    strength = RNG.uniform(0, 1, SHAPE).astype(np.float32)
    height, width = ((side - 2 * BORDER_PX) // cell_px for side in SHAPE)
    empty = np.s_[BORDER_PX : BORDER_PX + cell_px, BORDER_PX : BORDER_PX + cell_px]
    strength[empty] = 0.0
    rows, columns = most_distinct(strength, cell_px)
    expected = []
    for i, k in np.ndindex(height, width):
        top, left = BORDER_PX + i * cell_px, BORDER_PX + k * cell_px
        cell = strength[top : top + cell_px, left : left + cell_px]
        if cell.max() > 0:
            at = np.unravel_index(cell.argmax(), cell.shape)
            expected.append((top + int(at[0]), left + int(at[1])))
    assert list(zip(rows.tolist(), columns.tolist(), strict=True)) == expected
    assert len(expected) == height * width - 1


def test_a_picture_with_no_room_for_a_cell_has_no_patch():
    just = 2 * BORDER_PX + 4
    ones = np.ones((just, just), np.float32)
    assert [one.tolist() for one in most_distinct(ones, 4)] == [[6], [6]]
    assert [len(one) for one in most_distinct(ones[:-1], 4)] == [0, 0]
    assert [len(one) for one in most_distinct(ones[:0], 4)] == [0, 0]


def test_squares_that_begin_at_pixels_give_their_most_distinct_one():
    strength = RNG.uniform(0, 1, (12, 15)).astype(np.float32)
    begin_rows, begin_columns = np.array([0, 5, 10]), np.array([0, 9, 13])
    rows, columns = most_distinct_near(strength, begin_rows, begin_columns, 3)
    for i in range(3):
        v, u = begin_rows[i], begin_columns[i]
        square = strength[v : v + 3, u : u + 3]
        assert strength[rows[i], columns[i]] == square.max()
        assert v <= rows[i] < v + 3
        assert u <= columns[i] < u + 3


def lerp(one: Map, other: Map, share: float) -> Map:
    return one + share * (other - one)


def plain_fit(
    picture: NDArray[np.float32], v: int, u: int, begin: Map, across: Map, reach_px: float
) -> tuple[Map, float, float] | None:
    """Shift, correlation and sigma across; None where the patch is lost."""
    p = REFERENCE[v - 5 : v + 6, u - 5 : u + 6].astype(float)
    wide = picture.astype(float)
    steep = np.zeros((3, *SHAPE))
    steep[0] = wide
    steep[1][:, 1:-1] = 0.5 * (wide[:, 2:] - wide[:, :-2])
    steep[2][1:-1] = 0.5 * (wide[2:] - wide[:-2])
    at = begin.copy()
    for _ in range(10):
        left, top = int(np.floor(u + at[0])) - 5, int(np.floor(v + at[1])) - 5
        if left < 1 or top < 1 or left + 13 > SHAPE[1] or top + 13 > SHAPE[0]:
            return None
        s, t = (u + at[0]) % 1, (v + at[1]) % 1
        four = [
            steep[:, top + j : top + j + 11, left + k : left + k + 11]
            for j in (0, 1) for k in (0, 1)
        ]  # fmt: skip
        q, dx, dy = lerp(lerp(four[0], four[1], s), lerp(four[2], four[3], s), t)
        p0, q0, x0, y0 = (one.ravel() - one.mean() for one in (p, q, dx, dy))
        normal = np.array([[x0 @ x0, x0 @ y0], [x0 @ y0, y0 @ y0]])
        det = np.linalg.det(normal)
        if p0 @ p0 <= 0 or q0 @ q0 <= 0 or det <= 1e-9 * normal[0, 0] * normal[1, 1]:
            return None
        left_over = p0 / np.sqrt(p0 @ p0 / (q0 @ q0)) - q0
        step = np.linalg.solve(normal, [x0 @ left_over, y0 @ left_over])
        at = at + step
        if np.hypot(*(at - begin)) > reach_px:
            return None
        if np.abs(step).sum() < 0.02:
            correlation = p0 @ q0 / np.sqrt(p0 @ p0 * (q0 @ q0))
            variance = 2 * (q0 @ q0) * (1 - correlation) / (121 - 4)
            spread = across @ np.linalg.inv(normal) @ across
            return at, float(correlation), float(np.sqrt(variance * spread))
    return None


def test_patches_are_found_as_their_moments_tell():
    along, across = directions(*STEPS)
    shift = 2.3 * along + 0.6 * across
    moved = 0.8 * TEXTURE(COLUMNS - shift[0], ROWS - shift[1]) + 9.0
    picture = (moved + RNG.normal(0, 1.5, SHAPE)).astype(np.float32)
    picture[25:, 40:] = RNG.uniform(0, 200, (SHAPE[0] - 25, SHAPE[1] - 40))
    rows = RNG.integers(3, SHAPE[0] - 3, 80)
    columns = RNG.integers(3, SHAPE[1] - 3, 80)
    begin = np.stack([np.full(80, 2.0), np.zeros(80)]) + RNG.normal(0, 0.7, (2, 80))
    found = find_patches(REFERENCE, picture, rows, columns, begin[0], begin[1], STEPS, 1.8)
    expected = []
    for i in range(80):
        v, u = int(rows[i]), int(columns[i])
        if not (5 <= v < SHAPE[0] - 5 and 5 <= u < SHAPE[1] - 5):
            continue
        told = plain_fit(picture, v, u, begin[0, i] * along + begin[1, i] * across, across, 1.8)
        if told is not None and told[1] > 0.8:
            expected.append((v, u, told[0] @ along, told[0] @ across, told[2]))
    assert 15 < len(expected) < 70
    told = (found.rows, found.columns, found.along_px, found.across_px, found.sigma_px)
    assert np.stack(told) == pytest.approx(np.array(expected).T, rel=1e-3, abs=1e-3)
    assert np.median(found.along_px) == pytest.approx(2.3, abs=0.05)
    assert np.median(found.across_px) == pytest.approx(0.6, abs=0.05)


def test_patches_reach_to_five_pixels_from_the_rim_of_the_reference():
    rows, columns = np.array([4, 5, 20, 20, 40, 41]), np.array([20, 20, 5, 53, 20, 20])
    found = find_patches(
        REFERENCE, REFERENCE, rows, columns, np.full(6, 2.0), np.zeros(6), (1.0, 0.5), 3.0
    )
    inner = find_patches(
        REFERENCE, REFERENCE, np.array([6, 38]), np.array([6, 50]), np.zeros(2), np.zeros(2),
        (1.0, 0.0), 3.0,
    )  # fmt: skip
    assert set(found.rows.tolist()) <= {20}
    assert inner.rows.tolist() == [6, 38]
    assert inner.along_px == pytest.approx([0, 0], abs=1e-6)


@pytest.mark.parametrize("level", [0.0, 70.0])
def test_a_plain_patch_is_found_nowhere(level: float):
    flat = np.full(SHAPE, level, np.float32)
    place, begin = (np.array([20]), np.array([20])), (np.zeros(1), np.zeros(1))
    for one, other in ((flat, REFERENCE), (REFERENCE, flat), (flat, flat)):
        assert len(find_patches(one, other, *place, *begin, STEPS, 3.0).rows) == 0
    stripes = (REFERENCE[:1] + np.zeros(SHAPE)).astype(np.float32)
    assert len(find_patches(stripes, stripes, *place, *begin, STEPS, 3.0).rows) == 0
