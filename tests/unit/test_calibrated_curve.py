"""The curve of a calibration alone: its law and sigma in closed form, and honest over many rigs."""

from dataclasses import replace

import numpy as np
import pytest

from rig.curve import Curve
from rig.curve.physical import Physical
from rig.errors import CurveError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rectification import rectify
from rig.geometry.rig_geometry import RigGeometry
from rig.optics.calibrated_curve import curve_of_calibration
from rig.optics.prior import prior_covariance
from rig.profile.models import PriorSigmaConfig
from tests.support.calibration_scene import TrueCamera, random_scene
from tests.support.depth_alone import misses
from tests.unit.geometry.calibration.test_honesty import solve

FOCAL_PX, PITCH_MM = 880.0, 75.0
PAIR = ((0.0, 0.0), (1.0, 0.0))
CROSS = (*PAIR, (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
PRIOR = PriorSigmaConfig(focal_pct=0.3, baseline_pct=0.3, turn_deg=0.02)


def straight(places: tuple[tuple[float, float], ...] = PAIR) -> RigGeometry:
    """Cameras that look straight ahead, without a lens, at places in view steps."""
    camera = CameraModel(1280, 800, FOCAL_PX, FOCAL_PX, 639.5, 399.5)
    poses = [Pose(np.eye(3), np.array([-x * PITCH_MM, -y * PITCH_MM, 0.0])) for x, y in places]
    return RigGeometry(
        tuple("abcde"[: len(places)]), 0, (camera,) * len(places), (Pose.identity(), *poses[1:])
    )


def curve_with(
    sigmas: dict[int, float], max_sigma_pct: float = 1.0, geometry: RigGeometry | None = None
) -> Curve:
    """The curve of a pair of which some numbers, by index, are known to a sigma only."""
    pair = geometry or straight()
    variance = np.zeros(pair.parameter_count)
    for number, sigma in sigmas.items():
        variance[number] = sigma**2
    return curve_of_calibration(
        rectify(pair, PITCH_MM),
        np.diag(variance),
        max_sigma_pct=max_sigma_pct,
        source="calibration 3",
    )


def sigma_pct(curve: Curve, distance_mm: float) -> float:
    at = np.array([distance_mm])
    sigma_mm = curve.depth_sigma_mm(curve.law.slope_px(at), np.zeros(1))
    return 100.0 * float(sigma_mm[0]) / distance_mm


def test_the_law_is_triangulation_by_focal_length_and_pitch():
    curve = curve_with({})
    assert isinstance(curve.law, Physical)
    assert curve.law.z0_mm == 0.0
    assert curve.law.a_px_mm == pytest.approx(66000.0, rel=1e-12)
    assert curve.law.m_inf_px == pytest.approx(0.0, abs=1e-9)
    assert curve.scatter_px == 0.0
    # 0.3 of the width, and two pixels, of disparity.
    assert curve.valid_mm == pytest.approx((66000.0 / 384.0, 33000.0))


def test_a_baseline_that_is_off_moves_every_depth_in_proportion():
    curve = curve_with({8 + 3: 0.225})  # x of the translation: 0.3 % of 75 mm
    for distance_mm in (400.0, 1000.0, 5000.0):
        assert sigma_pct(curve, distance_mm) == pytest.approx(0.3, rel=1e-3)
    assert curve.field is not None
    assert np.array(curve.field.covariance) == pytest.approx(np.zeros((2, 2)), abs=1e-12)


def test_a_turn_moves_the_slope_by_the_same_pixels_at_every_distance():
    curve = curve_with({8 + 1: 1e-4})  # about y
    sigma_px = curve.curve_sigma_px(np.array([400.0, 2000.0, 7000.0]))
    # The pose turns the frame of the reference: every point of the axis by the same angle.
    assert sigma_px == pytest.approx(np.full(3, 0.088), rel=1e-4)


def test_it_ends_where_it_knows_depth_no_better_than_it_may():
    curve = curve_with({8 + 1: 1e-3}, max_sigma_pct=2.0)
    # 0.88 px at every distance: sigma / Z = 0.88 Z / 66000.
    assert curve.valid_mm[1] == pytest.approx(0.02 * 66000.0 / 0.88, rel=2e-3)
    assert sigma_pct(curve, curve.valid_mm[1]) == pytest.approx(2.0, rel=2e-3)
    assert curve.valid_mm[0] == pytest.approx(66000.0 / 384.0)


def test_a_calibration_that_knows_no_depth_is_told_with_what_it_knows():
    with pytest.raises(CurveError, match=r"calibration 3 alone knows depth to \+-\d") as refused:
        curve_with({8 + 1: 0.02}, max_sigma_pct=0.5)
    assert "allows +-1 %" in str(refused.value)
    assert "quality.depth_sigma_pct" in refused.value.advice


def test_views_that_look_apart_tell_no_depth():
    pair = straight()
    away = Pose.from_vectors(np.array([0.0, 1.2, 0.0]), np.array([-PITCH_MM, 0.0, 0.0]))
    apart = replace(pair, cam_from_reference=(Pose.identity(), away))
    with pytest.raises(CurveError, match="do not see the reference camera's axis together"):
        curve_with({}, geometry=apart)


def test_a_view_that_rolls_grows_from_the_axis_up_and_down():
    curve = curve_with({8 + 2: 1e-3})  # about z
    assert curve.field is not None
    (xx, xy), (_, yy) = curve.field.covariance
    assert yy**0.5 == pytest.approx(1e-3, rel=1e-3)  # px of disparity per px of picture
    assert xx**0.5 < 1e-4
    assert abs(xy) < 1e-8
    assert curve.field.per_px == (0.0, 0.0)
    assert curve.field.at_px == pytest.approx((639.5, 399.5), abs=1e-6)
    assert float(curve.curve_sigma_px(np.array([1000.0]))[0]) == pytest.approx(0.0, abs=1e-6)


def test_stated_sigmas_become_a_covariance_in_the_order_of_the_geometry():
    turned = Pose.from_vectors(np.array([0.0, 0.0, 0.01]), np.array([-PITCH_MM, 0.0, 0.0]))
    pair = replace(straight(), cam_from_reference=(Pose.identity(), turned))
    covariance = prior_covariance(pair, PRIOR)
    sigma = np.sqrt(np.diag(covariance))
    assert sigma[[0, 1, 4, 5]] == pytest.approx(0.003 * FOCAL_PX)
    assert sigma[[2, 3, 6, 7]].tolist() == [0.0, 0.0, 0.0, 0.0]
    assert covariance[0, 1] == pytest.approx((0.003 * FOCAL_PX) ** 2)
    assert covariance[0, 4] == 0.0
    assert sigma[8:11] == pytest.approx(np.radians(0.02), rel=1e-4)
    assert sigma[11:] == pytest.approx(0.003 * PITCH_MM)


def drawn(rng: np.random.Generator, place: tuple[float, float], sigma: PriorSigmaConfig):
    """A true camera that a straight one with these sigmas may be."""
    focal_px = FOCAL_PX * (1.0 + sigma.focal_pct / 100.0 * rng.standard_normal())
    if place == (0.0, 0.0):
        return TrueCamera((0.0, 0.0, 0.0), focal_px=(focal_px, focal_px))
    step_mm = PITCH_MM * float(np.hypot(*place))
    centre = np.array([*place, 0.0]) * PITCH_MM
    centre += sigma.baseline_pct / 100.0 * step_mm * rng.standard_normal(3)
    return TrueCamera(
        tuple(centre.tolist()),
        tuple((sigma.turn_deg * rng.standard_normal(3)).tolist()),
        (focal_px, focal_px),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "places", [PAIR, pytest.param(CROSS, marks=pytest.mark.slow)], ids=["pair", "cross"]
)
def test_true_depth_lies_within_two_sigma_as_often_as_it_should(
    places: tuple[tuple[float, float], ...],
):
    geometry = straight(places)
    rectification = rectify(geometry, PITCH_MM)
    covariance = prior_covariance(geometry, PRIOR)
    curve = curve_of_calibration(
        rectification, covariance, max_sigma_pct=5.0, source="calibration 1"
    )
    rng = np.random.default_rng(7)
    found: list[np.ndarray] = []
    for _ in range(300):
        true = [drawn(rng, place, PRIOR) for place in places]
        found.append(misses(rectification, curve, true, (500.0, 1000.0, 2500.0)))
    every = np.concatenate(found)
    assert 0.93 < np.mean(np.abs(every) <= 2.0) < 0.97
    assert np.sqrt(np.mean(every**2)) == pytest.approx(1.0, abs=0.12)


@pytest.mark.slow
def test_the_covariance_of_a_solve_tells_the_depth_error_of_its_curve():
    shares: list[float] = []
    for seed in range(12):
        scene = random_scene(100 + seed, 20)
        geometry = solve(scene.sightings(seed)).geometry
        assert geometry.covariance is not None
        rectification = rectify(geometry, PITCH_MM)
        curve = curve_of_calibration(
            rectification, geometry.covariance, max_sigma_pct=1.0, source="calibration 1"
        )
        cameras = [camera for camera in scene.cameras if isinstance(camera, TrueCamera)]
        off = misses(rectification, curve, cameras, (400.0, 600.0, 1000.0, 2000.0, 3000.0))
        shares.append(float(np.mean(np.abs(off) <= 2.0)))
    assert 0.90 < np.mean(shares) < 0.99  # twelve rigs, the points of each err together
