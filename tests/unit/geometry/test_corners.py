"""Corners of a checkerboard against closed-form truth, and the reasons for having none."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.errors import TargetError
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import corner_motion_px, find_corners
from tests.support.board_images import BoardScene, digitised

BOARD = Checkerboard(9, 6, 25.0)


def picture(scene: BoardScene, *, noise: float = 2.0, gain: float = 1.0) -> NDArray[np.uint8]:
    return digitised(scene.clean(), noise=noise, rng=np.random.default_rng(1), gain=gain)


@pytest.mark.parametrize(
    "tilt_deg",
    [(0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (20.0, -25.0, 40.0), (-30.0, 10.0, 135.0), (0, 40.0, 180)],
)
def test_corners_lie_within_a_hundredth_of_a_pixel_in_the_boards_order(
    tilt_deg: tuple[float, float, float],
):
    scene = BoardScene(tilt_deg=tilt_deg, distance_mm=620.0, background_contrast=40.0)
    corners = find_corners(picture(scene), BOARD)
    error = corners.xy_px - scene.corners()
    assert np.sqrt(np.mean(error**2)) < 0.01
    assert np.std(error / corners.sigma_px[..., None]) == pytest.approx(1.0, abs=0.3)
    assert corners.contrast == pytest.approx(150, rel=0.05)


def test_without_noise_corners_are_exact():
    scene = BoardScene(tilt_deg=(10.0, 15.0, 20.0))
    corners = find_corners(scene.clean(), BOARD)
    assert np.abs(corners.xy_px - scene.corners()).max() < 0.005
    # The lens's blur and the pixel's own width add in quadrature.
    assert corners.blur_px == pytest.approx(np.hypot(0.9, 12**-0.5), rel=0.01)


@pytest.mark.parametrize("kind", [np.uint16, np.float32])
def test_sixteen_bits_and_floats_are_as_good(kind: type[np.uint16] | type[np.float32]):
    scene = BoardScene()
    grey = digitised(scene.clean(), noise=2.0, rng=np.random.default_rng(1))
    image = (grey.astype(np.uint16) * 16) if kind is np.uint16 else grey.astype(np.float32)
    found = find_corners(image, BOARD)
    assert found.xy_px == pytest.approx(find_corners(grey, BOARD).xy_px, abs=1e-4)


def test_a_board_that_fits_either_way_up_starts_at_the_top_left():
    scene = BoardScene(columns=8, rows=6, tilt_deg=(0.0, 0.0, 170.0))
    corners = find_corners(picture(scene), Checkerboard(8, 6, 25.0))
    assert corners.xy_px == pytest.approx(scene.corners()[::-1, ::-1], abs=0.05)
    assert corners.xy_px[0, 0].sum() < corners.xy_px[-1, -1].sum()


def test_a_square_board_is_found_in_all_four_turns():
    for turn_deg in (10.0, 100.0, 190.0, 280.0):
        scene = BoardScene(columns=6, rows=6, tilt_deg=(0.0, 0.0, turn_deg))
        xy_px = find_corners(picture(scene), Checkerboard(6, 6, 25.0)).xy_px
        assert xy_px[0, 0].sum() < xy_px[-1, -1].sum()
        across, down = xy_px[0, -1] - xy_px[0, 0], xy_px[-1, 0] - xy_px[0, 0]
        assert np.linalg.det(np.stack([across, down])) > 0


def test_a_blurred_board_is_still_measured_on_a_coarser_picture():
    scene = BoardScene(distance_mm=350.0, blur_px=5.0)
    corners = find_corners(picture(scene), BOARD)
    assert corners.blur_px == pytest.approx(5.0, rel=0.05)
    assert np.sqrt(np.mean((corners.xy_px - scene.corners()) ** 2)) < 0.05


def refusal(image: NDArray[np.uint8], board: Checkerboard = BOARD) -> TargetError:
    with pytest.raises(TargetError) as refused:
        find_corners(image, board)
    return refused.value


@pytest.mark.parametrize(
    "asked", [Checkerboard(8, 6, 25.0), Checkerboard(9, 7, 25.0), Checkerboard(11, 8, 25.0)]
)
def test_a_wrong_count_names_the_count_that_fits(asked: Checkerboard):
    error = refusal(picture(BoardScene(tilt_deg=(5.0, 10.0, 15.0))), asked)
    assert error.reason == "wrong-count"
    assert "9 x 6" in str(error)


@pytest.mark.parametrize(
    ("offset_mm", "border"),
    [((-260.0, 0.0), "left"), ((270.0, 0.0), "right"), ((0, -150.0), "top"), ((0, 150), "bottom")],
)
def test_a_clipped_board_names_the_border(offset_mm: tuple[float, float], border: str):
    error = refusal(picture(BoardScene(distance_mm=500.0, offset_mm=offset_mm)))
    assert error.reason == "clipped"
    assert f"up to the {border} border" in str(error)


@pytest.mark.parametrize(("inset_px", "found"), [(6.0, True), (2.0, False)])
def test_corners_close_to_the_border_are_fitted_or_clipped(inset_px: float, found: bool):
    top_px = BoardScene().corners()[..., 1].min()
    image = picture(BoardScene())[round(top_px - inset_px) :]
    if found:
        assert find_corners(image, BOARD).xy_px[0, 0, 1] == pytest.approx(inset_px, abs=0.6)
    else:
        assert refusal(image).reason == "clipped"


def test_a_distant_board_is_too_small():
    error = refusal(picture(BoardScene(distance_mm=2500.0, blur_px=0.6)))
    assert error.reason == "too-small"
    assert "5.6 px" in str(error)


@pytest.mark.parametrize("blur_px", [5.0, 6.0])
def test_a_board_out_of_focus_is_blurred(blur_px: float):
    error = refusal(picture(BoardScene(distance_mm=700.0, blur_px=blur_px)))
    assert error.reason == "blurred"
    assert "squares of 20.0 px" in str(error)


def test_exposure_is_blamed_where_it_is_to_blame():
    assert refusal(picture(BoardScene(), gain=8.0)).reason == "over-exposed"
    assert refusal(picture(BoardScene(), gain=0.01)).reason == "under-exposed"


def test_a_covered_board_is_counted():
    image = picture(BoardScene())
    image[165:225, 305:355] = 90  # 2 x 3 corners
    error = refusal(image)
    assert error.reason == "clipped"
    assert "found 40 of 54; uncover the board" in str(error)


@pytest.mark.parametrize("seed", range(3))
def test_noise_and_scenery_are_no_board(seed: int):
    rng = np.random.default_rng(seed)
    noise = rng.integers(0, 250, (200, 320)).astype(np.uint8)
    assert refusal(noise).reason == "not-found"
    scenery = np.clip(
        110 + 400 * cv2.GaussianBlur(rng.standard_normal((400, 640)), (0, 0), 3), 0, 250
    )
    assert refusal(scenery.astype(np.uint8)).reason == "not-found"


@pytest.mark.parametrize(
    "image", [np.zeros((400, 640), np.uint8), np.full((400, 640), 90, np.uint8)]
)
def test_flat_pictures_are_refused(image: NDArray[np.uint8]):
    assert refusal(image).reason in ("under-exposed", "not-found")


def test_nan_and_slivers_are_refused():
    for image in (np.full((40, 40), np.nan, np.float32), np.zeros((4, 400), np.uint8)):
        with pytest.raises(TargetError, match="finite pixels"):
            find_corners(image, BOARD)


def test_motion_is_the_rms_shift_of_the_corners():
    scene = BoardScene()
    moved = scene.with_changes(offset_mm=(0.5, 0.0))
    first, last = (find_corners(s.clean(), BOARD) for s in (scene, moved))
    assert corner_motion_px(first, last) == pytest.approx(0.5 * 560 / 700, abs=0.005)
    other = find_corners(BoardScene(columns=8).clean(), Checkerboard(8, 6, 25.0))
    with pytest.raises(TargetError, match="9 x 6 and 8 x 6"):
        corner_motion_px(first, other)
