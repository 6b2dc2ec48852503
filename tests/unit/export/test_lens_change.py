"""Lenses that another format does not have, and how far two geometries agree."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rig.errors import FormatError
from rig.export.agreement import aligned, largest_gap_px
from rig.export.lens_change import Narrow, exact_lens, refit
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

EYE = np.eye(3).tolist()


def camera(lens: LensModel, coefficients: tuple[float, ...]) -> CameraModel:
    return CameraModel(640, 400, 500.0, 501.0, 321.0, 202.0, lens, coefficients)


@pytest.mark.parametrize(
    ("lens", "coefficients", "held", "exact"),
    [
        ("none", (), "brown4", (0, 0, 0, 0)),
        ("none", (), "brown8", (0,) * 8),
        ("none", (), "none", ()),
        ("brown5", (1, 2, 3, 4, 0), "brown4", (1, 2, 3, 4)),
        ("brown5", (1, 2, 3, 4, 5), "brown8", (1, 2, 3, 4, 5, 0, 0, 0)),
        ("brown8", (1, 2, 3, 4, 5, 0, 0, 0), "brown5", (1, 2, 3, 4, 5)),
        ("fisheye", (1, 2, 3, 4), "fisheye", (1, 2, 3, 4)),
    ],
)
def test_a_lens_is_held_where_nothing_is_lost(
    lens: LensModel, coefficients: tuple[float, ...], held: Narrow, exact: tuple[float, ...]
) -> None:
    assert exact_lens(camera(lens, coefficients), held, view="a", tool="it") == exact


@pytest.mark.parametrize(
    ("lens", "coefficients", "held"),
    [
        ("brown5", (1, 2, 3, 4, 5), "brown4"),
        ("brown8", (1, 2, 3, 4, 5, 0, 0, 8), "brown5"),
        ("brown8", (1, 2, 3, 4, 5, 6, 0, 0), "brown5"),
        ("fisheye", (1, 2, 3, 4), "brown8"),
        ("fisheye", (0, 0, 0, 0), "brown5"),
        ("brown5", (1, 2, 3, 4, 5), "fisheye"),
        ("brown5", (0, 0, 0, 0, 0), "none"),
    ],
)
def test_a_lens_that_would_lose_something_is_refused(
    lens: LensModel, coefficients: tuple[float, ...], held: Narrow
) -> None:
    with pytest.raises(FormatError, match=f"view a: it cannot hold its lens {lens}"):
        exact_lens(camera(lens, coefficients), held, view="a", tool="it")


@pytest.mark.parametrize(
    ("lens", "coefficients", "held"),
    [
        ("brown5", (-0.1, 0.02, 1e-3, -2e-3, 0.0), "brown4"),
        ("brown5", (-0.1, 0.02, 1e-3, -2e-3, 0.01), "brown5"),
        ("brown8", (-0.1, 0.02, 1e-3, -2e-3, 0.01, 0.0, 0.0, 0.0), "brown5"),
        ("fisheye", (-0.02, 0.006, -0.003, 0.0008), "fisheye"),
    ],
)
def test_a_lens_that_fits_is_found_again(
    lens: LensModel, coefficients: tuple[float, ...], held: Narrow
) -> None:
    original = camera(lens, coefficients)
    found = refit(original, held)
    assert found.largest_px < 1e-6
    assert found.rms_px <= found.largest_px
    fitted = found.camera
    assert (fitted.width_px, fitted.height_px) == (640, 400)
    assert (fitted.fx_px, fitted.fy_px, fitted.cx_px, fitted.cy_px) == pytest.approx(
        (500.0, 501.0, 321.0, 202.0)
    )
    count = len(fitted.coefficients)
    assert fitted.coefficients == pytest.approx(coefficients[:count], abs=1e-9)


def test_a_refit_tells_its_error_over_all_of_the_picture() -> None:
    original = camera("brown5", (-0.2, 0.0, 0.0, 0.0, 0.05))
    found = refit(original, "brown4")
    assert found.camera.coefficients[4] == 0.0
    u, v = np.meshgrid(np.linspace(0.0, 639.0, 33), np.linspace(0.0, 399.0, 25))
    pixels = np.stack([u.ravel(), v.ravel()], axis=1)
    points = np.column_stack([original.unproject(pixels), np.ones(len(pixels))])
    apart_px = np.linalg.norm(found.camera.project(points) - pixels, axis=1)
    assert found.largest_px == pytest.approx(apart_px.max())
    assert found.rms_px == pytest.approx(np.sqrt(np.mean(apart_px**2)))
    assert 0.0 < found.rms_px < found.largest_px < 1.0


def plain(
    change: Callable[[CameraModel], CameraModel] = lambda c: c, x_mm: float = 0.0
) -> RigGeometry:
    one = camera("none", ())
    poses = (Pose.identity(), Pose(np.eye(3), np.array([-60.0 + x_mm, 0.0, 0.0])))
    return RigGeometry(("a", "b"), 0, (one, change(one)), poses)


def test_the_gap_is_the_largest_of_all_depths_and_views() -> None:
    assert largest_gap_px(plain(), plain()) == pytest.approx(0.0, abs=1e-9)
    shifted = plain(lambda c: replace(c, cx_px=c.cx_px + 0.25))
    assert largest_gap_px(plain(), shifted) == pytest.approx(0.25)
    # A camera 1 mm beside: seen at the nearest of the depths, 300 mm, f / 300 px.
    assert largest_gap_px(plain(), plain(x_mm=1.0)) == pytest.approx(500.0 / 300.0)
    # A focal length 1 % longer: at the corner of the picture, (321, 202) px from the middle.
    longer = plain(lambda c: replace(c, fx_px=505.0, fy_px=506.01))
    assert largest_gap_px(plain(), longer) == pytest.approx(0.01 * np.hypot(321.0, 202.0))


def test_what_belongs_to_the_old_reference_stays_behind() -> None:
    one = plain()
    whole = replace(one, covariance=np.eye(one.parameter_count))
    assert aligned(whole, ("a", "b"), "a").covariance is not None
    assert aligned(whole, ("a", "b"), "b").covariance is None
    assert aligned(whole, ("b", "a"), "a").covariance is None
    turned = aligned(whole, ("b", "a"), "b")
    assert (turned.names, turned.reference) == (("b", "a"), 0)
    assert turned.centres_mm() == pytest.approx(np.array([[0.0, 0.0, 0.0], [-60.0, 0.0, 0.0]]))
    with pytest.raises(FormatError, match="with c as reference"):
        aligned(whole, ("a", "b"), "c")
    with pytest.raises(FormatError, match="asked for the views a, c"):
        aligned(whole, ("a", "c"), "a")
