"""Views of any size and any way up, brought into one common frame."""

import numpy as np
import pytest

from rig.epipolar.board.fit import fit_board_slope
from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.resample import Resampler
from rig.errors import SlopeError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rectification import rectify
from rig.geometry.rig_geometry import RigGeometry
from rig.optics.calibrated import CalibratedOptics
from rig.optics.calibrated_views import CalibratedViews
from rig.optics.nominal import nominal_optics
from rig.optics.softening import noise_left, softening_px
from rig.profile.load import load_profile
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry

PITCH_MM, WALL_MM = 40.0, 600.0
CAMERAS = (
    CameraModel(160, 100, 110.0, 110.0, 79.5, 49.5),
    CameraModel(100, 160, 110.0, 110.0, 49.5, 79.5),
    CameraModel(320, 200, 220.0, 220.0, 159.5, 99.5),
)
QUARTER, HALF = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.diag([-1.0, -1.0, 1.0])
PLACES_MM = np.array([[0.0, 0.0, 0.0], [-40.0, 0.0, 0.0], [60.0, 0.0, 0.0]])


def unlike_rig() -> RigGeometry:
    """A camera, another on its side, and one of four times as many pixels upside down."""
    turns = (np.eye(3), QUARTER, HALF)
    poses = tuple(Pose(turn, -turn @ at) for turn, at in zip(turns, PLACES_MM, strict=True))
    return RigGeometry(("plain", "side", "down"), 0, CAMERAS, poses)


def wall(x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
    """Grey value of a soft pattern on a wall; nothing of it is finer than the pixels."""
    return 120.0 + 40.0 * np.sin(x_mm / 25.0) + 40.0 * np.cos(y_mm / 31.0 + x_mm / 90.0)


def picture(geometry: RigGeometry, view: int) -> np.ndarray:
    camera, pose = geometry.cameras[view], geometry.cam_from_reference[view]
    x, y = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    rays = np.stack(
        [(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, np.ones(x.shape)], -1
    )
    at = PLACES_MM[view] + WALL_MM * (rays @ pose.rotation)
    return np.rint(wall(at[..., 0], at[..., 1])).astype(np.uint8)


def test_views_of_any_size_and_way_up_come_into_the_frame_of_the_reference() -> None:
    geometry = unlike_rig()
    optics = CalibratedOptics(rectify(geometry, PITCH_MM), None)
    views = optics.views([picture(geometry, view) for view in range(3)])
    assert views.images.shape == (3, 100, 160)
    assert views.x_steps == pytest.approx([0.0, -1.0, 1.5])
    assert views.y_steps == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    rectification = optics.rectification
    assert rectification.camera.fx_px == 110.0
    slope_px = 110.0 * PITCH_MM / WALL_MM - rectification.infinity_px
    x, y = np.meshgrid(np.arange(160.0), np.arange(100.0))
    for view in range(3):
        # What a pixel of this view shows, the reference view shows a slope farther.
        here_x = x + slope_px * views.x_steps[view] - rectification.centre_px[0]
        here_y = y - rectification.centre_px[1]
        wanted = wall(here_x * WALL_MM / 110.0, here_y * WALL_MM / 110.0)
        inner = (slice(12, -12), slice(45, -45))
        apart = (views.images[view] - wanted)[inner]
        # Softened to the pixels of the others, the finer one loses a little contrast.
        assert np.abs(apart).max() < (1.0 if view < 2 else 3.0)


def test_pictures_for_people_are_of_one_size() -> None:
    geometry = unlike_rig()
    optics = CalibratedOptics(rectify(geometry, PITCH_MM), None)
    shown = np.asarray(optics.pictures([picture(geometry, view) for view in range(3)]))
    assert (shown.shape, shown.dtype) == ((3, 100, 160), np.dtype(np.uint8))


def test_pictures_of_another_size_than_calibrated_are_refused_view_by_view() -> None:
    geometry = unlike_rig()
    pictures = [picture(geometry, view) for view in (0, 2, 1)]
    with pytest.raises(
        SlopeError,
        match=r"3 pictures of 160 x 100, 320 x 200, 100 x 160 px given, .* 3 cameras of 160 x 100, "
        "100 x 160, 320 x 200 px",
    ):
        CalibratedViews(pictures, rectify(geometry, PITCH_MM))


def test_without_a_calibration_views_must_be_of_one_size() -> None:
    profile = load_profile("sim-mixed")
    optics = nominal_optics(profile)
    assert optics.size_px == (1920, 1080)
    pictures = [np.zeros((80, 128), np.uint8), np.zeros((108, 192), np.uint8)]
    with pytest.raises(SlopeError, match=r"128 x 80, 192 x 108 px without a calib.*rig calibrate"):
        optics.views(pictures)
    assert optics.pictures(pictures) is pictures


def test_raw_pixels_per_rectified_pixel() -> None:
    rectification = rectify(unlike_rig(), PITCH_MM)
    assert [rectification.finer(view) for view in range(3)] == pytest.approx([1.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("finer", "soft_px"),
    [
        ((1.0, 2.0, 1.0), (0.0, 0.8 * 3.0**0.5, 0.0)),
        ((1.0, 0.5, 0.5), (0.8 * 3.0**0.5, 0.0, 0.0)),
        ((1.0, 1.25, 1.1), (0.0, 0.0, 0.0)),
        ((1.0, 1.26), (0.0, 0.8 * (1.26**2 - 1.0) ** 0.5)),
    ],
)
def test_finer_views_are_softened_to_the_coarsest(
    finer: tuple[float, ...], soft_px: tuple[float, ...]
) -> None:
    assert softening_px(finer) == pytest.approx(soft_px)


def test_a_picture_is_softened_before_it_is_resampled() -> None:
    x, y = np.meshgrid(np.arange(41.0), np.arange(31.0))
    point = np.zeros((31, 41), np.float32)
    point[15, 20] = 1000.0
    places = np.stack([x, y], axis=-1)
    soft, sharp = Resampler([places, places], [(31, 41)] * 2, [1.5, 0.0])([point, point])
    assert (sharp == point).all()
    assert soft.sum() == pytest.approx(1000.0, rel=1e-3)
    for away in (x - 20.0, y - 15.0):
        assert (soft * away**2).sum() / soft.sum() == pytest.approx(1.5**2, rel=0.02)


def test_softening_leaves_less_noise() -> None:
    assert noise_left([0.0, 0.0]) == 1.0
    assert noise_left([1.5, 1.5]) == pytest.approx(1.0 / (4.0 * np.pi * 1.5**2), rel=1e-6)
    assert noise_left([1.5, 0.0, 0.0]) == pytest.approx((2.0 + noise_left([1.5])) / 3.0)


def test_the_noise_of_softened_views_is_what_is_left() -> None:
    geometry = unlike_rig()
    told = NoiseModel(2.0, 30.0, 1.0)
    views = CalibratedOptics(rectify(geometry, PITCH_MM), None, told).views(
        [picture(geometry, view) for view in range(3)]
    )
    left = (2.0 + noise_left([0.8 * 3.0**0.5])) / 3.0
    assert views.noise is not None
    assert views.noise.read_noise_levels == pytest.approx(2.0 * left**0.5)
    assert views.noise.electrons_per_level == pytest.approx(30.0 / left)
    assert views.noise.step_levels == pytest.approx(left**0.5)


MIXED = (
    "camera.sizes_px.left=[400,250]",
    "camera.sizes_px.middle=[480,300]",
    "camera.sizes_px.right=[250,400]",
    "world.optics.focal_px=370.0",
    "world.view_errors.left.focal_px=270.0",
    "world.view_errors.left.rotation_deg=[0.3,-0.2,180.0]",
    "world.view_errors.right.focal_px=280.0",
    "world.view_errors.right.rotation_deg=[0.2,0.3,90.0]",
    "target.columns=8",
)


@pytest.mark.slow
def test_a_board_that_fits_either_way_up_is_measured_by_cameras_that_stand_otherwise() -> None:
    rig = SmallRig(MIXED, name="sim-mixed")
    rig.slide.at_mm = 620.0 - 1203.0
    with rig.camera() as camera:
        images = camera.grab(1.0).images
    assert [image.shape for image in images] == [(250, 400), (300, 480), (400, 250)]
    truth_mm = rig.world.true_distance_mm(rig.clock.now_s())
    rectification = rectify(true_geometry(rig.profile, rig.world.moment(0.0)), 37.5)
    views = CalibratedViews(images, rectification)
    board = Checkerboard(8, 6, 25.0)
    found = fit_board_slope(views, [find_corners(image, board) for image in images])
    centre_px = np.array(found.centre_px)
    slope_px = rectification.axis_slope_px(np.array(found.slope_px), centre_px)
    depth_mm = rectification.inverse_law_px_mm / (slope_px + rectification.infinity_px)
    assert found.views == (0, 1, 2)
    assert float(depth_mm) == pytest.approx(truth_mm, rel=3e-4)
    assert found.track_residual_px < 0.05
