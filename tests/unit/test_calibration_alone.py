"""Depth without a sweep: which curve a run takes, what it says of it, and what it searches."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from rig.calibration_alone import completed_run, curve_alone
from rig.curve import Curve
from rig.curve.physical import Physical
from rig.curve_rows import require_same_rows, widened_by_rows
from rig.database import Store, open_store
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.row_errors import RowErrors
from rig.errors import CalibrationError, ConfigError, CurveError, StoreError
from rig.factory import FactoryCamera
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.live.curves import load_curve
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.optics.factory import factory_geometry
from rig.optics.nominal import nominal_optics
from rig.optics.prior import PRIOR_SIGMAS, prior_covariance
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.run import Run, RunCurve
from rig.stored import open_run
from rig.sweep.job import new_sweep
from rig.sweep.request import SweepRequest
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry
from tests.support.stores import sqlite_url
from tests.support.sweeps import stored_sweep

SMALL = SmallRig(name="sim-real")
GEOMETRY = true_geometry(SMALL.profile, SMALL.world.moment(0.0))
OAK = load_profile("oak-d", ["slopes.range_mm=[500.0, 3000.0]"])
STRAIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MATRIX = ((880.0, 0.0, 639.5), (0.0, 880.0, 399.5), (0.0, 0.0, 1.0))
LEFT = FactoryCamera("left", 1280, 800, MATRIX, (0.0,) * 14, False, STRAIGHT, (0.0, 0.0, 0.0))
RIGHT = replace(LEFT, view="right", centre_mm=(75.0, 0.0, 0.0))


@dataclass
class Device:
    """An opened camera, as far as it knows itself."""

    factory_calibration: Sequence[FactoryCamera] | None


def calibrated(store: Store, quality: dict[str, object], *, rig: str | None = None) -> int:
    profile = SMALL.profile
    return store.save_calibration(
        rig=rig or profile.name,
        geometry=geometry_to_json(replace(GEOMETRY, stage=None)),
        quality=quality,
        profile=profile.model_dump(mode="json"),
        versions={},
        devices={},
        temperature_degc=None,
        image_size_px=(GEOMETRY.cameras[0].width_px, GEOMETRY.cameras[0].height_px),
    )


def run_with(profile: Profile, curve: Curve | None = None) -> Run:
    optics = calibrated_optics(profile, GEOMETRY, 3)
    return Run(profile, optics, None if curve is None else RunCurve(None, curve, None))


def physical(valid_mm: tuple[float, float], m_inf_px: float = -10.0) -> Curve:
    variance = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.01))
    return Curve(Physical(0.0, 24000.0, m_inf_px), variance, valid_mm, 0.0)


def test_a_rig_with_a_calibration_and_no_sweep_takes_the_curve_of_that(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        number = calibrated(store, {"imported": "kalibr"})
        run = open_run(store, SMALL.profile)
        assert run.curve is not None
        assert (run.curve.id, run.curve.sweep_id) == (None, None)
        assert run.curve.source == f"calibration {number}"
        assert run.curve.title == f"the curve of calibration {number}"
        assert isinstance(run.optics, CalibratedOptics)
        law = run.optics.axis_law
        assert run.curve.curve.params == law.params()
        assert open_run(store, SMALL.profile, None, "none").curve is None
        with pytest.raises(StoreError, match="asked for curve 7"):
            open_run(store, SMALL.profile, None, 7)
        with pytest.raises(StoreError, match="rig calibrate or rig import gives one"):
            open_run(store, SMALL.profile, "none")


@pytest.mark.slow
def test_a_swept_curve_takes_over_and_one_that_missed_a_gate_is_not_passed_by(tmp_path: Path):
    store, result = stored_sweep(tmp_path)
    with store:
        profile = load_profile("sim", ["name=bench"])
        calibrated(store, {}, rig="bench")
        with pytest.raises(CurveError, match=f"curve {result.curve_id} was measured with no calib"):
            open_run(store, profile)
        assert store.has_curve("bench")
        assert not store.has_curve("another")


@pytest.mark.slow
def test_the_sigma_of_an_import_is_that_of_its_source_or_of_the_profile(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        of_source: list[float] = []
        for source in ("kalibr", "colmap", "somebody"):
            calibrated(store, {"imported": source})
            curve = open_run(store, SMALL.profile).curve
            assert curve is not None
            of_source.append(curve.error_pct[1])
        assert of_source[0] < of_source[1] < of_source[2]
        told = load_profile(
            "sim-real", ["prior_sigma={focal_pct=0.0, baseline_pct=0.5, turn_deg=0.0}"]
        ).model_copy(update={"camera": SMALL.profile.camera})
        curve = open_run(store, told).curve
        assert curve is not None
        distance_mm, error_pct = curve.error_pct
        assert distance_mm == 1000.0
        # Four views at about one step, each baseline off by 0.5 % along and across: k=2 is 1 % / 2.
        assert error_pct == pytest.approx(0.5, rel=0.1)


def test_a_program_loads_the_curve_of_a_calibration_by_the_name_of_its_rig(tmp_path: Path):
    url = sqlite_url(tmp_path)
    with open_store(url) as store:
        calibrated(store, {"imported": "kalibr"})
        expected = open_run(store, SMALL.profile).curve
    assert expected is not None
    assert load_curve(SMALL.profile.name, database=url).params == expected.curve.params
    with pytest.raises(StoreError, match="found curves of no rig"):
        load_curve("another", database=url)


def test_a_covariance_goes_before_stated_sigmas():
    run = Run(SMALL.profile, calibrated_optics(SMALL.profile, GEOMETRY, 3))
    sure = 0.01 * prior_covariance(GEOMETRY, PRIOR_SIGMAS["factory"])
    known = replace(
        run,
        optics=calibrated_optics(SMALL.profile, replace(GEOMETRY, covariance=sure), 3),
    )
    assert curve_alone(known).error_pct[1] == pytest.approx(
        0.1 * curve_alone(run).error_pct[1], rel=1e-6
    )
    with pytest.raises(CalibrationError, match="rig sim-real has none"):
        curve_alone(Run(SMALL.profile, nominal_optics(SMALL.profile)))


def test_an_oak_without_a_calibration_awaits_that_of_its_device(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        waiting = open_run(store, OAK)
        assert (waiting.awaits, waiting.curve) == ("depth", None)
        assert open_run(store, OAK, None, "none").awaits == "slopes"
        assert open_run(store, load_profile("oak-d"), None, "none").awaits is None
        assert load_profile("sim").camera.may_hold_calibration is False
    run = completed_run(waiting, Device((LEFT, RIGHT)))
    assert run.awaits is None
    assert run.calibration is None
    assert run.optics.calibration_id is None
    assert run.curve is not None
    assert (run.curve.source, run.curve.title) == (
        "factory",
        "the curve of the factory's calibration",
    )
    assert run.curve.curve.params["a_px_mm"] == pytest.approx(66000.0)
    slopes = completed_run(replace(waiting, awaits="slopes"), Device((LEFT, RIGHT)))
    assert slopes.curve is None
    assert slopes.range_px[1] > 132.0
    assert completed_run(run, Device(None)) is run


def test_a_device_that_holds_none_is_told_with_what_gives_one():
    waiting = Run(OAK, nominal_optics(OAK), awaits="depth")
    for device in (Device(None), object()):
        with pytest.raises(StoreError, match="the device holds none of its own") as refused:
            completed_run(waiting, device)
        assert refused.value.advice.startswith("run `rig calibrate oak-d` or `rig import oak-d")


def test_what_is_not_proven_is_said_with_its_error():
    run = completed_run(Run(OAK, nominal_optics(OAK), awaits="depth"), Device((LEFT, RIGHT)))
    first, second = run.notices
    # 0.3 % of the mean focal length, of the baseline, and 0.02 degrees of 880 px and 66 px, k=2.
    turn_pct = 100.0 * np.radians(0.02) * 880.0 / 66.0
    expected = 2.0 * np.sqrt(0.3**2 / 1.0 + 0.3**2 + turn_pct**2)
    assert run.curve is not None
    assert run.curve.error_pct[1] == pytest.approx(expected, rel=0.1)
    assert first.startswith("depth by the factory's calibration alone, not proven: +-1.")
    assert first.endswith(" % at 1 m, k=2; `rig sweep oak-d` proves it")
    assert second.startswith("slopes.range_mm = [500, 3000] goes beyond the curve of the factory")
    told = run.curve.as_dict()
    assert told["source"] == "factory"
    assert told["id"] is None
    assert told["proven"] is False
    assert run.curve.in_words.startswith("the curve of the factory's calibration, not proven: +-1.")
    assert told["error"] == {"at_mm": 1000.0, "pct_k2": run.curve.error_pct[1]}


def test_a_swept_curve_has_nothing_to_say_of_itself():
    curve = RunCurve(4, physical((400.0, 1200.0)), 7)
    run = replace(run_with(SMALL.profile), curve=curve)
    assert run.notices == ()
    assert (curve.source, curve.title, curve.in_words) == ("sweep 7", "curve 4", "curve 4")
    assert curve.as_dict()["proven"] is True
    assert RunCurve(None, physical((400.0, 1200.0)), None).source == "given"


def test_a_curve_answers_in_the_distances_that_the_profile_looks_for_only():
    near = load_profile("sim-real", ["slopes.range_mm=[500.0, 900.0]"])
    cut = RunCurve(4, physical((400.0, 1200.0)), 7).within(near)
    assert cut.curve.valid_mm == (500.0, 900.0)
    assert cut.proven_mm == (400.0, 1200.0)
    depth_mm = cut.curve.depth_mm(24000.0 / np.array([450.0, 600.0, 1000.0]) - 10.0)
    assert np.isnan(depth_mm).tolist() == [True, False, True]
    wide = load_profile("sim-real", ["slopes.range_mm=[300.0, 900.0]"])
    beyond = RunCurve(4, physical((400.0, 1200.0)), 7).within(wide)
    assert replace(run_with(wide), curve=beyond).notices == (
        "slopes.range_mm = [300, 900] goes beyond curve 4, valid 400-1200 mm: no depth outside of "
        "that",
    )
    far = load_profile("sim-real", ["slopes.range_mm=[2000.0, 9000.0]"])
    with pytest.raises(CurveError, match="curve 4 is valid 400-1200 mm"):
        RunCurve(4, physical((400.0, 1200.0)), 7).within(far)


def test_slopes_follow_from_distances_by_the_curve_and_beyond_it_by_its_law():
    profile = load_profile("sim", ["slopes.range_mm=[300.0, 2400.0]"])
    run = Run(profile, nominal_optics(profile), RunCurve(4, physical((400.0, 1200.0)), 7))
    low_px, high_px = run.range_px
    # 2 % of 70 px, two sigmas of 0.1 px, and one and a half labels of 0.4 px at 1.08 steps.
    room_px = 0.02 * 70.0 + 0.2 + 1.5 * 0.4 / 1.08
    assert low_px == pytest.approx(24000.0 / 2400.0 - 10.0 - room_px)
    assert high_px == pytest.approx(24000.0 / 300.0 - 10.0 + room_px)


def test_slopes_follow_from_distances_by_the_calibration_over_the_whole_picture():
    profile = load_profile("sim-real", ["slopes.range_mm=[400.0, 1200.0]"]).model_copy(
        update={"camera": SMALL.profile.camera}
    )
    run = run_with(profile)
    assert isinstance(run.optics, CalibratedOptics)
    rectification = run.optics.rectification
    height, width = rectification.shape
    corners = np.array([[0.0, width - 1.0, 0.0, width - 1.0], [0.0, 0.0, height - 1, height - 1]])
    low_px, high_px = run.range_px
    m0 = rectification.infinity_px
    for distance_mm in (400.0, 1200.0):
        whole_px = (
            rectification.inverse_law_px_mm / distance_mm * rectification.depth_ratio(corners)
        )
        assert (whole_px - m0 > low_px).all()
        assert (whole_px - m0 < high_px).all()


def test_distances_that_nothing_turns_into_slopes_are_refused_with_what_does():
    profile = load_profile("sim", ["slopes.range_mm=[400.0, 1200.0]"])
    run = Run(profile, nominal_optics(profile))
    with pytest.raises(ConfigError, match="no calibration and no curve") as refused:
        run.require_range()
    assert "`rig calibrate sim`" in refused.value.advice
    assert "slopes.range_px" in refused.value.advice
    assert Run(load_profile("sim"), run.optics).range_px == (-18.0, 30.0)


def test_a_sweep_of_distances_that_nothing_turns_into_slopes_ends_before_anything_moves(
    tmp_path: Path,
):
    profile = load_profile("sim", ["slopes.range_mm=[400.0, 1200.0]"])
    with (
        open_store(sqlite_url(tmp_path)) as store,
        pytest.raises(ConfigError, match=r"slopes.range_mm = \[400, 1200\] asked for"),
    ):
        new_sweep(store, profile, SweepRequest())


def test_rows_that_miss_make_a_calibration_alone_less_sure_and_refuse_nothing():
    alone = RunCurve(None, physical((400.0, 1200.0)), None, alone="factory")
    run = replace(run_with(SMALL.profile), curve=alone)
    views = len(SMALL.profile.views)
    missed = RowErrors.none(views)
    missed = replace(missed, rms_px=np.full(views, 0.5) * (np.arange(views) > 0))
    mending = Mending(missed, ())
    wider = widened_by_rows(run, mending)
    assert wider.curve is not None
    steps2 = np.asarray(run.optics.x_steps) ** 2 + np.asarray(run.optics.y_steps) ** 2
    added_px2 = 0.25 / float(steps2.sum())
    assert wider.curve.curve.covariance[2][2] == pytest.approx(0.01 + added_px2)
    assert wider.curve.curve.covariance[0] == (0.0, 0.0, 0.0)
    require_same_rows(wider, mending)
    swept = replace(run, curve=RunCurve(4, physical((400.0, 1200.0)), 7))
    assert widened_by_rows(swept, mending) is swept


def test_a_factory_geometry_is_seen_from_the_reference_of_the_profile():
    turned = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    rolled = replace(RIGHT, rotation=turned)
    geometry = factory_geometry(OAK, (LEFT, rolled))
    assert geometry.names == ("left", "right")
    # A point on the left axis is 75 mm left of the right camera, which is rolled a quarter.
    point = geometry.cam_from_reference[1].apply(np.array([[0.0, 0.0, 1000.0]]))
    assert point == pytest.approx(np.array([[0.0, 75.0, 1000.0]]))
    assert geometry.cameras[0].lens == "brown5"
    eight = replace(LEFT, distortion=(0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0))
    assert factory_geometry(OAK, (eight, RIGHT)).cameras[0].lens == "brown8"
    fisheye = replace(LEFT, distortion=(0.1, 0.2, 0.3, 0.4, 0.0), is_fisheye=True)
    camera = factory_geometry(OAK, (fisheye, RIGHT)).cameras[0]
    assert (camera.lens, camera.coefficients) == ("fisheye", (0.1, 0.2, 0.3, 0.4))


def test_a_factory_calibration_of_other_views_or_lenses_is_refused():
    with pytest.raises(ConfigError, match="is of left, rig oak-d has left, right"):
        factory_geometry(OAK, (LEFT,))
    prism = replace(LEFT, distortion=(*LEFT.distortion[:8], 0.1))
    with pytest.raises(ConfigError, match="view left has 9 lens coefficients"):
        factory_geometry(OAK, (prism, RIGHT))
