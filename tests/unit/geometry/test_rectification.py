"""Rectification against the projective geometry of the simulator, which shares no line with it."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.pose import Pose
from rig.geometry.rectification import Rectification, rectify
from rig.geometry.rig_geometry import RigGeometry
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry


@pytest.fixture(scope="module")
def rig() -> SmallRig:
    return SmallRig(name="sim-real")


@pytest.fixture(scope="module")
def geometry(rig: SmallRig) -> RigGeometry:
    return true_geometry(rig.profile, rig.world.moment(0.0))


@pytest.fixture(scope="module")
def found(rig: SmallRig, geometry: RigGeometry) -> Rectification:
    return rectify(geometry, rig.profile.pitch_mm)


def points_mm(count: int = 200) -> Float:
    """Points in the frame of the reference camera, all over its picture."""
    numbers = np.random.default_rng(5)
    depth = numbers.uniform(400.0, 1200.0, count)
    across, down = numbers.uniform(-0.45, 0.45, count), numbers.uniform(-0.28, 0.28, count)
    return np.stack([across * depth, down * depth, depth], axis=1)


def seen_px(rig: SmallRig, points: Float) -> list[Float]:
    """Where the true cameras show points of the reference camera's frame."""
    cameras = rig.world.moment(0.0).cameras
    reference = cameras[rig.profile.reference]
    world = points @ reference.rotation.T + np.asarray(reference.position_mm)
    return [camera.pixels(world) for camera in cameras]


def common_slopes_px(found: Rectification, points: Float) -> Float:
    depth = points @ found.common_from_reference[2]
    return found.camera.fx_px * found.pitch_mm / depth - found.infinity_px


def test_every_point_lies_on_its_line_exactly(rig: SmallRig, found: Rectification) -> None:
    points = points_mm()
    places = [found.rectified_px(v, seen) for v, seen in enumerate(seen_px(rig, points))]
    slopes = common_slopes_px(found, points)
    for view, place in enumerate(places):
        on_line = found.line_px(view, places[0].T, slopes).T
        assert np.abs(on_line - place).max() < 1e-8


def test_the_lines_are_straight_but_for_what_leaves_the_plane(
    rig: SmallRig, found: Rectification
) -> None:
    points = points_mm()
    places = [found.rectified_px(v, seen) for v, seen in enumerate(seen_px(rig, points))]
    slopes = common_slopes_px(found, points)[:, None]
    beside = [
        place - (places[0] - slopes * (found.x_steps[v], found.y_steps[v]))
        for v, place in enumerate(places)
    ]
    # 0.25 mm before the plane: u z (1/Z - 1/Z_focus), at the edge of the picture, at 400 mm.
    assert 0.02 < np.abs(beside).max() < 0.1
    # What a fit over all views makes of it is the same all over the picture: the plane is chosen
    # so. It depends on the slope alone, and is less than 0.03 % of the whole slope.
    steps = np.stack([found.x_steps, found.y_steps], axis=1)
    steps = steps - steps.mean(axis=0)
    bias_px = -np.einsum("vi,vni->ni", steps, np.stack(beside)) / (steps**2).sum(axis=0)
    uniform = slopes * (slopes + found.infinity_px)
    factor, *_ = np.linalg.lstsq(uniform, bias_px)
    assert np.abs(bias_px).max() < 3e-4 * (slopes.max() + found.infinity_px)
    assert np.abs(bias_px - uniform * factor).max() < 0.002


def test_the_reference_cameras_own_orientation_would_be_worse(
    rig: SmallRig, geometry: RigGeometry, found: Rectification
) -> None:
    forward_mm = found.z_steps * found.camera.fx_px * found.pitch_mm
    assert np.abs(forward_mm - forward_mm.mean()).max() < 0.2
    assert np.abs(geometry.centres_mm()[:, 2]).max() > 0.8


def test_raw_and_rectified_pixels_are_inverse(rig: SmallRig, found: Rectification) -> None:
    for view, seen in enumerate(seen_px(rig, points_mm())):
        again = found.raw_px(view, found.rectified_px(view, seen))
        assert np.abs(again - seen).max() < 1e-8


def test_depth_is_that_of_the_reference_camera(rig: SmallRig, found: Rectification) -> None:
    """One law for the whole picture: m = a / Z - m0, with Z along the reference camera's +z."""
    points = points_mm()
    places = found.rectified_px(0, seen_px(rig, points)[0]).T
    axis_px = found.axis_slope_px(common_slopes_px(found, points), places)
    law_px = found.inverse_law_px_mm / points[:, 2] - found.infinity_px
    assert np.abs(axis_px - law_px).max() < 1e-9
    on_axis = found.rectified_px(0, seen_px(rig, np.array([[0.0, 0.0, 500.0]]))[0]).T
    assert found.depth_ratio(on_axis) == pytest.approx(1.0, abs=1e-12)


def test_pictures_keep_their_middle_and_the_focus_distance_its_place(
    rig: SmallRig, found: Rectification
) -> None:
    map_px = found.raw_map_px(0)
    assert map_px.shape == (400, 640, 2)
    middle = np.array([[319.5, 199.5]])
    for view in range(5):
        assert np.abs(found.raw_px(view, middle) - middle).max() < 12.0
    assert found.focus_mm == pytest.approx(rig.world.focus_mm, rel=0.03)


def test_a_row_of_cameras_keeps_the_tilt_that_it_says_nothing_about() -> None:
    rig = SmallRig(name="sim-real")
    whole = true_geometry(rig.profile, rig.world.moment(0.0))
    row = RigGeometry(
        names=whole.names[:3],
        reference=0,
        cameras=whole.cameras[:3],
        cam_from_reference=whole.cam_from_reference[:3],
    )
    found = rectify(row, rig.profile.pitch_mm)
    # Turned about y, into the row; about x there is nothing to turn by.
    assert abs(np.degrees(found.common_from_reference[2, 0])) > 0.3
    assert abs(np.degrees(found.common_from_reference[2, 1])) < 0.05
    assert np.abs(np.diff(found.z_steps[1:])).max() * found.camera.fx_px < 1e-3


def test_parallel_cameras_without_faults_need_nothing() -> None:
    rig = SmallRig(name="sim")
    found = rectify(true_geometry(rig.profile, rig.world.moment(0.0)), rig.profile.pitch_mm)
    assert [v.x_steps for v in rig.profile.views] == pytest.approx(found.x_steps, abs=1e-12)
    assert [v.y_steps for v in rig.profile.views] == pytest.approx(found.y_steps, abs=1e-12)
    assert found.z_steps == pytest.approx(np.zeros(5), abs=1e-15)
    assert found.focus_mm == pytest.approx(700.0, abs=1e-9)
    straight = np.stack(np.meshgrid(np.arange(640.0), np.arange(400.0)), axis=-1)
    for view in range(5):
        assert np.abs(found.raw_map_px(view) - straight).max() < 1e-9


def test_cameras_at_one_place_are_refused(geometry: RigGeometry) -> None:
    still = replace(geometry, cam_from_reference=(Pose.identity(),) * 5)
    with pytest.raises(ConfigError, match="stand at one place"):
        rectify(still, 40.0)
