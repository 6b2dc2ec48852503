"""The numbers of a board's slope, each by a sum of its own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews
from rig.epipolar.board.corner_tracks import corner_epipolar_error, fit_corner_tracks
from rig.epipolar.board.dense import dense_board_slope, measure_dense
from rig.epipolar.board.light import LightField
from rig.epipolar.board.lines import BoardLines
from rig.epipolar.board.misalignment import Misalignment, is_misaligned
from rig.epipolar.board.sigma import Scores, asymmetry_px, plane_covariance
from rig.epipolar.board.slope import BoardSlope
from rig.epipolar.spline import spline_coefficients
from rig.epipolar.views import SlopeMap
from rig.errors import SlopeError
from tests.unit.epipolar.test_board_prior import BOARD, SHAPE

Array = NDArray[np.float64]
RNG = np.random.default_rng(91)
X_STEPS, Y_STEPS = np.array([-1.0, 0.0, 1.3, 0.2]), np.array([0.1, 0.0, 0.0, -1.4])
CENTRE_PX = np.array([50.0, 40.0])
ROWS, COLUMNS = np.mgrid[0:4, 0:5]


def tracks(noise: float, light: float) -> list[Array]:
    here = np.stack([20.0 + 15 * COLUMNS, 10.0 + 18 * ROWS], axis=-1)
    slope = 2.0 + (here - CENTRE_PX) @ [0.01, -0.02] + light * (1 - 2 * ((ROWS + COLUMNS) % 2))
    return [
        here - slope[..., None] * np.array([x, y]) + noise * RNG.normal(size=here.shape)
        for x, y in zip(X_STEPS, Y_STEPS, strict=True)
    ]


def test_tracks_are_one_least_squares_fit_of_each_corner_and_a_plane_of_their_slopes():
    seen = tracks(0.05, 0.03)
    found = fit_corner_tracks(seen, X_STEPS, Y_STEPS, 1, CENTRE_PX)
    slopes, squares = [], 0.0
    for v, u in np.ndindex(4, 5):
        # Unknowns of a corner: its place and its slope.
        design = np.array([
            row for x, y in zip(X_STEPS, Y_STEPS, strict=True)
            for row in ([1.0, 0.0, -x], [0.0, 1.0, -y])
        ])  # fmt: skip
        values = np.concatenate([view[v, u] for view in seen])
        fitted, *_ = np.linalg.lstsq(design, values)
        slopes.append(fitted[2])
        squares += float(((values - design @ fitted) ** 2).sum())
    colour = (1.0 - 2.0 * ((ROWS + COLUMNS) % 2)).ravel()
    offset = seen[1].reshape(-1, 2) - CENTRE_PX
    design = np.column_stack([np.ones(20), offset, colour])
    fitted, left, *_ = np.linalg.lstsq(design, np.array(slopes))
    covariance = np.linalg.inv(design.T @ design) * left[0] / (20 - 4)
    assert found.plane == pytest.approx(fitted[:3])
    assert found.sigma_px == pytest.approx(covariance[0, 0] ** 0.5)
    assert found.residual_px == pytest.approx((squares / (20 * 8 - 20 * 3)) ** 0.5)


def test_corners_lie_from_the_lines_of_the_reference_as_far_as_moved():
    here = np.stack([20.0 + 15 * COLUMNS, 10.0 + 18 * ROWS], axis=-1)
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    seen = [here + 9.0 * along + 0.5 * across, here, here + np.array([4.0, -2.0])]
    found = corner_epipolar_error(seen, np.array([3.0, 0.0, -2.0]), np.array([4.0, 0.0, 0.0]), 1)
    assert found.mean_px == pytest.approx(1.25)
    assert found.p95_px == pytest.approx(2.0)
    assert found.max_px == pytest.approx(2.0)


def gaussian_sum(influence: Array, pixels: Array, reach_px: float) -> Array:
    """Products of all pairs, less the farther they are apart."""
    square = ((pixels[:, :, None] - pixels[:, None, :]) ** 2).sum(axis=0)
    return influence @ np.exp(-0.5 * square / reach_px**2) @ influence.T


def scores(pixels: Array) -> Scores:
    count = pixels.shape[1]
    design = np.stack([np.ones(count), *(pixels - pixels.mean(axis=1, keepdims=True))])
    rate, residual = RNG.normal(0, 5, (3, count)), RNG.normal(0, 2, (3, count))
    normal = (design * (rate**2).sum(axis=0)) @ design.T
    return Scores(pixels, design, rate, residual, normal)


@pytest.mark.parametrize(("side_px", "reach_px"), [(3.0, 2.0), (6.0, 3.0), (90.0, 12.0)])
def test_covariance_sums_the_products_of_neighbouring_scores(side_px: float, reach_px: float):
    rows, columns = np.nonzero(RNG.random((26, 31)) < 0.2)
    told = scores(np.stack([columns + 7.0, rows + 3.0]).astype(np.float64))
    weight = (told.rate**2).sum(axis=0)
    share = gaussian_sum((weight / weight.sum())[None], told.pixels, reach_px)[0, 0]
    spare = max(1 - 3 * share, 0.25)
    score = told.design * (told.rate * told.residual).sum(axis=0)
    influence = np.linalg.inv(told.normal) @ score
    expected = gaussian_sum(influence, told.pixels, reach_px) / spare
    found = plane_covariance(told, side_px)
    assert found == pytest.approx(expected, rel=0.03, abs=0.03 * np.abs(expected).max(axis=1).min())
    assert found[0, 0] == pytest.approx(expected[0, 0], rel=0.02)


def test_asymmetry_is_what_a_free_bend_of_each_view_takes_from_the_slope():
    rows, columns = np.nonzero(np.ones((14, 16)))
    pixels = np.stack([columns + 5.0, rows + 2.0]).astype(np.float64)
    plain = scores(pixels)
    bend = RNG.normal(0, 3, (2, pixels.shape[1]))
    rate = plain.rate
    truth = np.array([0.4, 0.002, -0.003])
    bends = RNG.normal(0, 1, (3, 2))
    # What the views show: a wrong plane, a bend in each, hardly any noise.
    left = -rate * (truth @ plain.design) + bends @ bend + 0.01 * RNG.normal(size=rate.shape)
    smoother = replace(plain, residual=left)
    quiet = replace(plain, residual=0.01 * plain.residual)
    assert asymmetry_px(quiet, smoother, bend, 6.0) == pytest.approx(truth[0], rel=1e-2)
    noisy = replace(plain, residual=1e4 * plain.residual)
    assert asymmetry_px(noisy, smoother, bend, 6.0) == 0.0


def test_light_is_taken_out_with_what_smoothing_moves_where_the_gain_changes():
    rows, columns = np.mgrid[0:12, 0:20].astype(float)
    pixels = np.stack([columns.ravel() + 30, rows.ravel() + 10])
    centre = np.array([38.0, 15.0])
    field = LightField.over(pixels, centre)
    assert field.reach_px.ravel().tolist() == [11.0, 6.0]
    x, y = (pixels[0] - 38) / 11, (pixels[1] - 15) / 6
    assert field.basis == pytest.approx(np.stack([np.ones_like(x), x, y, x * x, x * y, y * y]))
    texture = 100 + 40 * np.sin(0.8 * pixels[0] + 0.5 * pixels[1])
    gradient = np.stack([0.8 * np.cos(0.8 * pixels[0]), 0.5 * np.cos(0.5 * pixels[1])]) * 40
    by_gain, by_offset = RNG.normal(0, 0.05, (2, 3, 6))
    for part in (by_gain, by_offset):
        part -= part.mean(axis=0)
    gains, offsets = (1 + by_gain[:, :1] * 0) + by_gain @ field.basis, 20 * by_offset @ field.basis
    middle = texture.mean()
    value = gains * (texture - middle) + offsets + middle
    level, told = field.levelled(value, gradient, 0.7)
    e = 1e-4
    expected = np.empty_like(value)
    for view in range(3):
        slopes = []
        for axis, reach in ((0, 11.0), (1, 6.0)):
            moved = [
                LightField.over(pixels, centre).basis if d == 0 else _basis(x, y, axis, d / reach)
                for d in (e, -e)
            ]
            slopes.append(by_gain[view] @ (moved[0] - moved[1]) / (2 * e))
        shift = 0.49 * (slopes[0] * gradient[0] + slopes[1] * gradient[1]) / gains[view]
        expected[view] = texture - middle - shift
    assert level == pytest.approx(expected, abs=1e-6)
    assert told == pytest.approx(1 + by_gain[:, 0])


def _basis(x: Array, y: Array, axis: int, step: float) -> Array:
    x, y = (x + step, y) if axis == 0 else (x, y + step)
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])


def test_a_board_of_one_row_of_pixels_still_has_a_reach():
    field = LightField.over(np.array([[4.0, 5.0], [7.0, 7.0]]), np.array([4.5, 7.0]))
    assert field.reach_px.ravel().tolist() == [1.0, 1.0]


def test_tracks_are_bent_from_three_sigmas_of_a_corner():
    assert not is_misaligned(0.03, 0.01)
    assert is_misaligned(0.0301, 0.01)
    field = Misalignment(RNG.normal(size=(2, 2, 6)), np.array([5.0, 6.0]))
    x, y = 7.0, 9.0
    told = field.at(np.array([[x], [y]]))[:, :, 0]
    basis = np.array([1.0, 2.0, 3.0, 4.0, 6.0, 9.0])
    assert told == pytest.approx(field.coefficients @ basis)


def plain_dense(
    slopes: SlopeMap, board: BoardSlope, inside: NDArray[np.bool_]
) -> tuple[float, float]:
    """Tukey's regression from the board's plane, and its sandwich over blocks of 16 px."""
    row, column = np.nonzero(inside & (slopes.label > 0))
    design = np.column_stack([np.ones(row.size), column - 80.0, row - 60.0])
    value, sigma = (m[row, column].astype(float) for m in (slopes.slope_px, slopes.sigma_px))
    plane = np.array(board.plane)

    def weights() -> tuple[Array, Array, Array]:
        rest = np.asarray(value - design @ plane, np.float64)
        z = rest / sigma
        square = (z / (4.685 * 1.4826 * np.median(np.abs(z)))) ** 2
        w = np.where(square < 1, (1 - square) ** 2, 0) / sigma**2
        rate = np.where(square < 1, (1 - square) * (1 - 5 * square), 0) / sigma**2
        return w, rate, rest

    for _ in range(10):
        w = weights()[0]
        plane = np.linalg.solve(design.T @ (w[:, None] * design), design.T @ (w * value))
    w, rate, rest = weights()
    bread = np.linalg.inv(design.T @ (rate[:, None] * design))
    meat = np.zeros((3, 3))
    blocks = list(zip(row // 16, column // 16, strict=True))
    for block in set(blocks):
        chosen = np.array([one == block for one in blocks])
        pull = design[chosen].T @ (w * rest)[chosen]
        meat += np.outer(pull, pull)
    return float(plane[0]), float((bread @ meat @ bread)[0, 0] ** 0.5)


def test_a_dense_map_is_reduced_by_a_robust_plane_and_its_blocks():
    y, x = np.indices(SHAPE).astype(float)
    rng = np.random.default_rng(4)
    slope = BOARD.slope_at(x, y) + 0.05 * rng.standard_normal(SHAPE) + 0.02
    slope[rng.random(SHAPE) < 0.1] += 1.0
    slopes = SlopeMap(
        slope.astype(np.float32), rng.uniform(0.03, 0.08, SHAPE).astype(np.float32),
        (rng.random(SHAPE) < 0.9).astype(np.uint8),
    )  # fmt: skip
    inside = np.zeros(SHAPE, np.bool_)
    inside[25:90, 40:110] = True
    square = replace(
        BOARD, outline_px=np.array([[40.0, 25.0], [109.0, 25.0], [109.0, 89.0], [40.0, 89.0]])
    )
    found = dense_board_slope(slopes, square)
    assert (found.slope_px, found.sigma_px) == pytest.approx(
        plain_dense(slopes, square, inside), rel=1e-4
    )
    assert found.pixels == np.count_nonzero(slopes.label[inside])


@pytest.mark.parametrize(("pixels", "is_enough"), [(99, False), (100, True)])
def test_a_hundred_pixels_are_enough(pixels: int, is_enough: bool):
    y, x = np.indices(SHAPE).astype(float)
    slope = (BOARD.slope_at(x, y) + 0.01 * RNG.standard_normal(SHAPE)).astype(np.float32)
    label = np.zeros(SHAPE, np.uint8)
    rows, columns = np.mgrid[45:55, 70:80]
    label[rows.ravel()[:pixels], columns.ravel()[:pixels]] = 1
    slopes = SlopeMap(slope, np.full(SHAPE, 0.01, np.float32), label)
    if is_enough:
        found = dense_board_slope(slopes, BOARD).pixels
    else:
        with pytest.raises(SlopeError, match="99 pixels of the board"):
            dense_board_slope(slopes, BOARD)
        found = 99
    assert found == pixels


def test_only_what_shows_the_board_is_searched_and_its_place_kept():
    rows, columns = np.mgrid[0:200, 0:260].astype(float)
    steps = np.array([-1.0, 0.0, 1.0])
    small = replace(
        BOARD,
        centre_px=(130.0, 100.0),
        plane=(2.0, 0.0, 0.0),
        slope_px=2.0,
        outline_px=np.array([[110.0, 80.0], [150.0, 80.0], [150.0, 120.0], [110.0, 120.0]]),
    )

    def grey(x: Array, y: Array) -> Array:
        return 120 + 40 * np.sin(0.9 * x + 0.4 * y) + 30 * np.cos(0.5 * x - 0.7 * y)

    images = np.stack([grey(columns + 2.0 * x, rows) for x in steps])
    images += np.random.default_rng(1).normal(0, 1.0, images.shape)
    far = images.copy()
    # Beyond two pixels of slope and 32 of surroundings nothing is looked at.
    for outside in (np.s_[:, :46], np.s_[:, 155:], np.s_[:, :, :76], np.s_[:, :, 185:]):
        far[outside] = 0.0
    views = RectifiedViews(images.astype(np.float32), steps, np.zeros(3), 1)
    found = measure_dense(views, (-3.0, 6.0), small)
    same = measure_dense(replace(views, images=far.astype(np.float32)), (-3.0, 6.0), small)
    assert found.slope_px == pytest.approx(2.0, abs=0.01)
    assert found.pixels > 1500
    assert found == same


def test_edges_are_the_steep_pixels_that_all_views_see():
    rows, columns = np.mgrid[0:60, 0:80]
    picture = (100 + 60 * ((rows // 15 + columns // 15) % 2)).astype(np.float32)
    views = RectifiedViews(
        np.stack([picture, picture, picture]),
        np.array([0.0, 1.0, -1.0]),
        np.array([0.0, 0.0, 0.5]),
        0,
    )
    coefficients = np.stack([spline_coefficients(one, 0.6) for one in views.images])
    centre = np.array([40.0, 30.0])
    lines = BoardLines(views, [0, 1, 2], coefficients, centre, Misalignment.none(3, centre))
    plane = np.array([6.0, 0.0, 0.0])
    outline = np.array([[0.0, 0.0], [79.0, 0.0], [79.0, 59.0], [0.0, 59.0]])
    paths = lines.edges(outline, plane, 0)
    x, y = paths.pixels
    # Places of the views at slope 6: 6 px left, and 6 px right and 3 px up.
    assert (x.min(), x.max()) == (9, 70)
    assert (y.min(), y.max()) == (6, 56)
    assert paths.places_px[1] == pytest.approx(paths.pixels - [[6], [0]])
    assert paths.places_px[2] == pytest.approx(paths.pixels - [[-6], [3]])
    assert paths.rates[:, :, 0] == pytest.approx(np.array([[0, 0], [-1, 0], [1, -0.5]]))
    assert paths.turns == pytest.approx(np.stack([np.eye(2)] * 3))
    near_edge = np.minimum(np.abs((x + 0.5) % 15 - 0), 15 - (x + 0.5) % 15) < 3
    near_edge |= np.minimum((y + 0.5) % 15, 15 - (y + 0.5) % 15) < 3
    assert near_edge.all()
    assert lines.steps() == pytest.approx(np.array([[0, -1 / 6], [1, -1 / 6], [-1, 1 / 3]]))
    with pytest.raises(SlopeError, match="no edge of it"):
        lines.edges(outline, np.array([90.0, 0.0, 0.0]), 0)
