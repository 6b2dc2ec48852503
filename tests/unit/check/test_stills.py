"""What repeated pictures tell, against pictures whose every pixel is known."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.check.stills import measure_stills, search_board
from rig.errors import TargetError
from rig.frames import Frame, MultiView
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import Corners
from tests.support.board_images import BoardScene

BOARD = Checkerboard(9, 6, 25.0)
SCENE = BoardScene(distance_mm=700.0)
RAMP = np.arange(101, dtype=np.uint8).reshape(1, 101)


def taken(
    pictures: Sequence[NDArray[np.uint8]], exposures_s: Sequence[float | None] = (None,) * 9
) -> list[MultiView]:
    """Of two views: the picture, and one that is all black."""
    return [
        MultiView(
            (
                Frame("left", picture, 0.1 * n, n, exposure_s=exposure_s),
                Frame("right", np.zeros_like(picture), 0.1 * n, n, exposure_s=0.5),
            )
        )
        for n, (picture, exposure_s) in enumerate(zip(pictures, exposures_s, strict=False))
    ]


def test_without_a_board_the_whole_first_picture_counts():
    grey = RAMP.copy()
    grey[0, :3] = 0
    grey[0, -2:] = 255
    left, right = measure_stills(taken([grey, RAMP]), None, samples=2)
    assert (left.view, right.view) == ("left", "right")
    assert (left.exposure.black, left.exposure.white) == (5.0, 95.0)
    assert left.exposure.full_scale == 255.0
    assert left.exposure.saturated_share == pytest.approx(2 / 101)
    assert left.exposure.empty_share == pytest.approx(3 / 101)
    assert right.exposure.empty_share == 1.0
    assert isinstance(left.board, TargetError)
    assert left.board.reason == "no-target"
    assert (left.motion_px, left.noise) == (None, None)


def test_brightness_is_compared_with_the_mean_of_all():
    even = [np.full((8, 8), level, np.uint8) for level in (100, 80, 120)]
    left, right = measure_stills(taken(even), None, samples=2)
    assert left.brightness_change == pytest.approx(0.2)
    assert right.brightness_change == 0.0


def test_every_exposure_is_told_once_and_in_order():
    pictures = [np.tile(RAMP, (9, 1))] * 4
    left, right = measure_stills(taken(pictures, [0.02, None, 0.01, 0.02]), None, samples=2)
    assert left.exposures_s == (0.01, 0.02)
    assert right.exposures_s == (0.5,)


def test_noise_is_told_from_three_pictures_on():
    random = np.random.default_rng(5)
    patches = np.kron(random.uniform(20.0, 200.0, (12, 16)), np.ones((10, 10)))
    pictures = [random.poisson(patches).clip(0, 255).astype(np.uint8) for _ in range(3)]
    assert measure_stills(taken(pictures), None, samples=2)[0].noise is not None
    assert measure_stills(taken(pictures[:2]), None, samples=2)[0].noise is None


def at_x(x_mm: float) -> NDArray[np.uint8]:
    return SCENE.with_changes(offset_mm=(x_mm, 0.0)).clean().astype(np.uint8)


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "moved"), [(1, None), (2, 1), (3, 2), (9, 3)])
def test_motion_counts_from_the_first_to_the_last_picture_of_a_stop(
    samples: int, moved: int | None
):
    pictures = [at_x(2.0 * n) for n in range(4)]
    found = measure_stills(taken(pictures), BOARD, samples=samples)[0]
    corners = [search_board(picture, BOARD) for picture in pictures]
    first = corners[0]
    assert isinstance(first, Corners)
    assert isinstance(found.board, Corners)
    assert np.array_equal(found.board.xy_px, first.xy_px)
    if moved is None:
        assert found.motion_px is None
        return
    last = corners[moved]
    assert isinstance(last, Corners)
    apart_px = np.linalg.norm(last.xy_px - first.xy_px, axis=-1)
    assert found.motion_px == pytest.approx(np.sqrt(np.mean(apart_px**2)), rel=0.01)


def test_a_board_that_goes_away_has_no_motion():
    pictures = [at_x(0.0), np.full_like(at_x(0.0), 90)]
    assert measure_stills(taken(pictures), BOARD, samples=2)[0].motion_px is None


def test_exposure_is_that_between_the_outermost_corners():
    picture = at_x(0.0)
    corners = search_board(picture, BOARD)
    assert isinstance(corners, Corners)
    xy_px = corners.xy_px
    v, u = np.indices(picture.shape)

    def within(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
        """On the side of the line from a to b where the middle of the board is."""
        normal = np.array([a[1] - b[1], b[0] - a[0]])
        middle = xy_px.reshape(-1, 2).mean(axis=0)
        side = normal[0] * (u - a[0]) + normal[1] * (v - a[1])
        return side * float(normal @ (middle - a)) > 0

    ends = [xy_px[0, 0], xy_px[0, -1], xy_px[-1, -1], xy_px[-1, 0]]
    inside = np.logical_and.reduce([within(a, b) for a, b in zip(ends, ends[1:] + ends[:1],
                                                                 strict=True)])  # fmt: skip
    # Paint the middle of a black square black as night.
    for row, column in ((0, 0), (0, 1)):
        square = xy_px[row : row + 2, column : column + 2].reshape(-1, 2)
        (u0, v0), (u1, v1) = square.min(axis=0) + 4, square.max(axis=0) - 4
        cells = (u > u0) & (u < u1) & (v > v0) & (v < v1)
        if picture[cells].mean() < 110:
            break
    painted = picture.copy()
    painted[cells] = 0
    found = measure_stills(taken([painted]), BOARD, samples=1)[0]
    assert isinstance(found.board, Corners)
    wanted = (cells & inside).sum() / inside.sum()
    assert wanted > 0.005
    assert found.exposure.empty_share == pytest.approx(wanted, rel=0.04)
    assert found.exposure.saturated_share == 0.0
