"""Simulated views of different sizes, lenses and ways up."""

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.profile.load import load_profile
from tests.support.cameras import SmallRig


def rolled(turn_deg: float) -> SmallRig:
    """The rig with its right view turned about its axis, without a lens."""
    return SmallRig(
        (
            f"world.view_errors.right.rotation_deg=[0.0,0.0,{turn_deg}]",
            "world.view_errors.right.distortion=[0.0,0.0,0.0,0.0,0.0]",
        ),
        name="sim-mixed",
    )


def test_every_view_has_its_own_size_and_focal_length() -> None:
    cameras = SmallRig(name="sim-mixed").world.moment(0.0).cameras
    assert [(c.width_px, c.height_px, c.focal_px) for c in cameras] == [
        (1280, 800, 880.0),
        (1920, 1080, 1450.0),
        (1280, 800, 880.0),
    ]


def test_a_warming_lens_grows_by_its_own_length() -> None:
    drift = ("world.optics.focal_drift_ppm_per_degc=1000.0", "world.temperature.rise_degc=1.0")
    world = SmallRig(drift, name="sim-mixed").world
    left, middle, _ = world.moment(1e9).cameras
    assert (left.focal_px, middle.focal_px) == pytest.approx((880.88, 1451.45))


@pytest.mark.parametrize(
    ("turn_deg", "sign_x", "sign_y"), [(0.0, 1, 0), (90.0, 0, -1), (180.0, -1, 0), (-90.0, 0, 1)]
)
def test_sensors_are_shifted_in_the_world_whichever_way_up(
    turn_deg: float, sign_x: int, sign_y: int
) -> None:
    """All views agree about a point at the focus distance: it lies in the middle of each."""
    right = rolled(turn_deg).world.moment(0.0).cameras[2]
    shift_px = 880.0 / 700.0 * 37.5
    assert right.centre_px == pytest.approx((639.5 + sign_x * shift_px, 399.5 + sign_y * shift_px))
    at_focus_mm = np.array([-0.6, 0.9, 699.6])  # where the reference's axis would be seen from it
    assert right.pixels(at_focus_mm) == pytest.approx((639.5, 399.5), abs=1e-9)


def test_sizes_are_given_for_every_view_or_none() -> None:
    whole = load_profile("sim-mixed")
    assert whole.camera.size_of("left") == (1280, 800)
    assert load_profile("sim").camera.size_of("left") == (640, 400)
    with pytest.raises(ConfigError, match=r"camera.sizes_px must name every view once.*middle"):
        load_profile("sim", ["camera.sizes_px.left=[640,400]", "camera.sizes_px.middle=[640,400]"])
