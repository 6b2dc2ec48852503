"""What stands between pictures and slopes, with the true calibration of a simulated rig."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from rig.epipolar import Label, NoiseModel, SlopeMap
from rig.epipolar.views import RectifiedViews
from rig.errors import ConfigError, CurveError, SlopeError
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.optics.calibrated_views import CalibratedViews
from rig.optics.nominal import nominal_optics
from rig.profile import CameraConfig, NoiseConfig, Profile
from rig.records import StoredCalibration, StoredCurve
from rig.stored import Run, optics_of, require_matching
from tests.support.cameras import SMALL, SmallRig
from tests.support.geometry import true_geometry

REAL = SmallRig(name="sim-real", overrides=SMALL)


def geometry() -> RigGeometry:
    return true_geometry(REAL.profile, REAL.world.moment(0.0))


def stored(profile: Profile = REAL.profile, **changes: object) -> StoredCalibration:
    calibration = StoredCalibration(
        id=3,
        rig=profile.name,
        created_at=datetime(2026, 1, 1, tzinfo=UTC),
        geometry=geometry_to_json(geometry()),
        quality={},
        profile=profile.model_dump(mode="json"),
        versions={},
        devices={},
        temperature_degc=None,
        image_size_px=(160, 100),
        active=True,
    )
    return replace(calibration, **changes)


def test_a_camera_of_any_kind_has_nominal_optics() -> None:
    """What other people's kinds do not say is None, and no error."""
    profile = REAL.profile.model_copy(update={"camera": CameraConfig(kind="of-others")})
    assert nominal_optics(profile).size_px is None
    assert nominal_optics(REAL.profile).size_px == (160, 100)


def test_without_a_calibration_everything_is_as_it_comes() -> None:
    images = np.random.default_rng(1).integers(0, 255, (5, 100, 160), dtype=np.uint8)
    optics = optics_of(REAL.profile, None)
    views = optics.views(images)
    assert views.images is images
    assert views.x_steps.tolist() == [view.x_steps for view in REAL.profile.views]
    assert optics.pictures(images) is images
    assert optics.calibration_id is None
    assert optics.distance_mm(412.5) == 412.5
    assert optics.axis_plane((1.0, 2.0, 3.0), (5.0, 6.0)) == (1.0, 2.0, 3.0)
    slopes = np.ones((100, 160), np.float32)
    assert optics.axis_slopes_px(slopes) is slopes
    assert isinstance(optics.board_views(images), RectifiedViews)


def test_with_one_the_stage_is_measured_and_pictures_are_brought_together() -> None:
    optics = optics_of(REAL.profile, stored())
    assert optics.calibration_id == 3
    with REAL.camera() as camera:
        images = camera.grab(1.0).images
    views = optics.views(images)
    assert views.images.dtype == np.float32
    assert views.noise is not None
    assert views.noise.sigma_levels(100.0) == pytest.approx(1.8, abs=0.5)
    assert np.asarray(optics.pictures(images)).dtype == np.uint8
    assert isinstance(optics.board_views(images), CalibratedViews)
    # The stage reads 600 mm; scale, axis and the turned camera make something else of it.
    truth_mm = REAL.world.true_distance_mm(REAL.clock.now_s())
    travelled_mm = REAL.slide.at_mm / 1.0015 + 1203.0
    assert optics.distance_mm(travelled_mm) == pytest.approx(truth_mm, abs=1e-3)
    assert abs(truth_mm - travelled_mm) > 0.1


def test_the_noise_that_the_profile_tells_goes_with_the_views() -> None:
    told = {"read_noise_levels": 0.8, "electrons_per_level": 30.0}
    camera = REAL.profile.camera.model_copy(update={"noise": NoiseConfig(**told)})
    profile = REAL.profile.model_copy(update={"camera": camera})
    images = np.zeros((len(profile.views), 100, 160), np.uint8)
    for optics in (nominal_optics(profile), optics_of(profile, stored())):
        assert optics.views(images).noise == NoiseModel(0.8, 30.0)
    assert nominal_optics(REAL.profile).views(images).noise is None


def test_one_depth_has_one_slope_on_the_axis_all_over_the_picture() -> None:
    optics = optics_of(REAL.profile, stored())
    assert isinstance(optics, CalibratedOptics)
    rectification = optics.rectification
    rows, columns = np.indices((100, 160), dtype=np.float64)
    ratio = rectification.depth_ratio(np.stack([columns, rows]))
    m0 = rectification.infinity_px
    at_600 = rectification.inverse_law_px_mm / 600.0
    seen = (at_600 * ratio - m0).astype(np.float32)
    assert np.ptp(seen) > 0.1
    on_axis = optics.axis_slopes_px(seen)
    assert np.abs(on_axis - (at_600 - m0)).max() < 1e-4
    # A plane that is square to the reference camera's axis has no tilt on the axis.
    x, y = 80.0, 50.0
    b = float(seen[50, 81] - seen[50, 79]) / 2.0
    c = float(seen[51, 80] - seen[49, 80]) / 2.0
    plane = optics.axis_plane((float(seen[50, 80]), b, c), (x, y))
    assert plane == pytest.approx((at_600 - m0, 0.0, 0.0), abs=2e-5)


def test_pixels_that_no_camera_shows_have_no_answer() -> None:
    """A reference camera with a pincushion lens does not fill the rectified picture."""
    true = geometry()
    bent = replace(true.cameras[0], coefficients=(0.3, 0.0, 0.0, 0.0, 0.0))
    optics = calibrated_optics(REAL.profile, replace(true, cameras=(bent, *true.cameras[1:])), 1)
    optics.views(np.zeros((5, 100, 160), np.uint8))
    ones = np.ones((100, 160), np.float32)
    found = optics.answered(SlopeMap(ones, ones, np.full((100, 160), 2, np.uint8)))
    unseen = found.label == Label.NONE
    assert 0.01 < unseen.mean() < 0.4
    assert unseen[0, 0]
    assert not unseen[50, 80]
    assert np.array_equal(np.isnan(found.slope_px), unseen)
    assert np.array_equal(np.isnan(found.sigma_px), unseen)


def test_another_rigs_calibration_is_refused() -> None:
    with pytest.raises(ConfigError, match="calibration 3 is of rig other, asked to use it for"):
        optics_of(REAL.profile, stored(rig="other"))
    fewer = replace(geometry(), names=("centre", "a", "b", "c", "d"))
    with pytest.raises(ConfigError, match="of the views centre, a, b, c, d about centre, rig"):
        calibrated_optics(REAL.profile, fewer, 3)


def test_swapped_views_are_refused() -> None:
    true = geometry()
    poses = list(true.cam_from_reference)
    poses[1], poses[2] = poses[2], poses[1]
    with pytest.raises(ConfigError, match=r"view left at \(0\.9.*swapped"):
        calibrated_optics(REAL.profile, replace(true, cam_from_reference=tuple(poses)), 3)
    still = (Pose.identity(),) * 5
    with pytest.raises(ConfigError, match="stand at one place"):
        calibrated_optics(REAL.profile, replace(true, cam_from_reference=still), 3)


def test_a_stage_that_counts_otherwise_is_refused() -> None:
    then = REAL.profile.model_dump(mode="json")
    then["stage"]["distance_at_machine_zero_mm"] = 1200.0
    with pytest.raises(ConfigError, match=r"distance_at_machine_zero_mm = 1200\.0, now it is 1203"):
        optics_of(REAL.profile, replace(stored(), profile=then))


def test_pictures_of_another_size_are_refused() -> None:
    optics = optics_of(REAL.profile, stored())
    wrong = np.zeros((5, 80, 160), np.uint8)
    with pytest.raises(SlopeError, match="pictures of 160 x 80 px given"):
        optics.views(wrong)
    with pytest.raises(SlopeError, match="pictures of 160 x 80 px given"):
        optics.board_views(wrong)


@pytest.mark.parametrize(("then", "now"), [(3, None), (None, 3), (2, 3)])
def test_a_curve_of_another_calibration_is_refused(then: int | None, now: int | None) -> None:
    run = Run(REAL.profile, optics_of(REAL.profile, stored() if now == 3 else None))
    curve = StoredCurve(7, "sim-real", 5, datetime(2026, 1, 1, tzinfo=UTC), {}, {}, {}, True, then)
    with pytest.raises(CurveError, match=r"curve 7 was measured with .*run `rig fit 5 --calib"):
        require_matching(run, REAL.profile, curve)
    require_matching(run, REAL.profile, replace(curve, calibration_id=now))
