import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_sim.optics import TrueCamera, distorted, rotation_matrix, undistorted

MILD = st.floats(-0.1, 0.1)


def camera(**changes: object) -> TrueCamera:
    values: dict[str, object] = {
        "view": "centre",
        "width_px": 640,
        "height_px": 400,
        "focal_px": 600.0,
        "centre_px": (330.0, 190.0),
        "position_mm": (10.0, -20.0, 5.0),
        "rotation_deg": (0.4, -0.3, 0.5),
        "distortion": (-0.06, 0.02, 0.0004, -0.0003, 0.001),
    }
    return TrueCamera(**(values | changes))  # pyright: ignore[reportArgumentType]


@settings(deadline=None, max_examples=50)
@given(
    k1=MILD, k2=MILD, p1=st.floats(-0.002, 0.002), x=st.floats(-0.55, 0.55), y=st.floats(-0.4, 0.4)
)
def test_undistorted_inverts_distorted(k1: float, k2: float, p1: float, x: float, y: float):
    coefficients = (k1, k2, p1, -p1, 0.0)
    there = distorted(np.array([x]), np.array([y]), coefficients)
    back = undistorted(*there, coefficients)
    assert back[0][0] == pytest.approx(x, abs=1e-9)
    assert back[1][0] == pytest.approx(y, abs=1e-9)


def test_a_distortion_that_folds_the_picture_is_refused():
    with pytest.raises(ValueError, match="cannot be inverted"):
        undistorted(np.array([0.9]), np.array([0.9]), (-1.5, 0.0, 0.0, 0.0, 0.0))


def test_a_point_on_a_pixels_ray_projects_to_that_pixel():
    seen = camera()
    x_px, y_px = np.array([0.0, 320.0, 639.0]), np.array([399.0, 10.0, 0.0])
    rays = seen.directions(x_px, y_px) @ seen.rotation.T
    points = np.asarray(seen.position_mm) + rays * np.array([[300.0], [700.0], [1500.0]])
    np.testing.assert_allclose(seen.pixels(points), np.stack([x_px, y_px], -1), atol=1e-6)


def test_a_quarter_turn_about_z_carries_right_to_down():
    np.testing.assert_allclose(rotation_matrix((0.0, 0.0, 90.0)) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_a_point_on_the_axis_is_seen_at_the_principal_point():
    straight = camera(rotation_deg=(0.0, 0.0, 0.0), position_mm=(0.0, 0.0, 0.0))
    assert straight.pixels(np.array([0.0, 0.0, 900.0])) == pytest.approx([330.0, 190.0])
