"""Judgements as pure functions: from what was measured to pass, warn or fail."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.check.arrangement import judge_arrangement
from rig.check.curve_drift import judge_curve_drift
from rig.check.items import failed, graded, worst
from rig.check.locks import judge_locks
from rig.check.noise import judge_noise
from rig.check.photon_transfer import PhotonTransfer
from rig.check.stage import (
    Arrival,
    judge_reading,
    judge_repeatability,
    judge_travel,
    repeatability,
)
from rig.check.stills import Exposure, ViewStills
from rig.check.storage import judge_room
from rig.check.timing import judge_drops, judge_rate, judge_skew, stream_of
from rig.curve import fit_curve
from rig.errors import DeviceLostError, StoreError, TargetError
from rig.frames import Frame, MultiView
from rig.profile import NoiseConfig
from rig.profile.load import load_profile, parse_profile
from rig.stored import RunCurve
from tests.support.curve_points import exact_sweep, physical_px

PROFILE = load_profile("sim")
STILL = ViewStills(
    view="left",
    board=TargetError("none", advice="put it there", reason="not-found"),
    motion_px=None,
    exposure=Exposure(255.0, 190.0, 20.0, 0.0, 0.0),
    noise=None,
    exposures_s=(0.008,),
    brightness_change=0.001,
)


def test_the_worst_status_counts():
    assert worst(["pass", "warn", "skip"]) == "warn"
    assert worst(["pass", "fail", "warn"]) == "fail"
    assert worst(["skip"]) == worst([]) == "skip"


def test_what_is_not_a_number_fails():
    assert graded(float("nan"), warn_above=1.0, fail_above=2.0) == "fail"


def test_an_error_is_split_into_what_was_found_and_what_to_do():
    item = failed("camera", DeviceLostError("camera a", "is gone", advice="plug it in"))
    assert (item.found, item.advice) == ("camera a: is gone", "plug it in")
    assert failed("camera", DeviceLostError("camera a", "is gone")).found == "camera a: is gone"


@pytest.mark.parametrize(
    ("row", "status"),
    [
        ((-1.0, 1.0), "warn"),
        ((-2.0, 1.0), "warn"),  # multiples of one spacing as well
        ((-1.06, 0.93), "pass"),
        ((-1.5, 1.0), "pass"),
    ],
)
def test_even_spacing_is_a_warning(row: tuple[float, float], status: str):
    overrides = [f"views.left.x_steps={row[0]}", f"views.right.x_steps={row[1]}"]
    assert judge_arrangement(load_profile("sim", overrides)).status == status


def test_exposure_that_changes_by_itself_fails():
    item = judge_locks(PROFILE.camera, {}, [replace(STILL, exposures_s=(0.008, 0.0092))])
    assert item.status == "fail"
    assert "left: exposure went from 8.00 to 9.20 ms" in item.found
    assert judge_locks(PROFILE.camera, {}, [STILL]).status == "pass"


def test_what_a_camera_could_lock_and_the_profile_leaves_alone_is_told():
    camera = load_profile("v4l2-pair-grbl", ["camera.gain=16"]).camera
    free = {"left.controls": "gain=16", "right.controls": "gain=16 focus_automatic_continuous=1"}
    item = judge_locks(camera, free, [STILL])
    assert item.status == "warn"
    assert "left to the camera: focus" in item.found
    assert "set camera.focus" in item.advice
    assert judge_locks(camera, {"left.controls": "gain=16"}, [STILL]).status == "pass"


def carried(**inner: object):
    """The camera of `sim-scan`, with a V4L2 camera on its slider."""
    data = load_profile("sim-scan").model_dump(mode="json", exclude_none=True)
    data["camera"]["inner"] = {
        **{"kind": "v4l2", "devices": {"camera": "/dev/video0"}, "pixel_format": "GREY"},
        **{"width_px": 640, "height_px": 400, "rate_hz": 30.0, **inner},
    }
    return parse_profile(data, source="test").camera


def test_what_a_carried_camera_leaves_alone_is_told_by_its_own_keys():
    free = {"controls": "exposure_time_absolute gain focus_absolute"}
    item = judge_locks(carried(gain=16), free, [STILL])
    assert item.status == "warn"
    assert "left to the camera: exposure, focus" in item.found
    assert "set camera.inner.exposure_s, camera.inner.focus:" in item.advice
    assert judge_locks(carried(exposure_s=0.008, gain=16, focus=3), free, [STILL]).status == "pass"


@pytest.mark.parametrize(("change", "status"), [(0.05, "warn"), (0.3, "fail")])
def test_light_that_changes_is_told(change: float, status: str):
    item = judge_locks(PROFILE.camera, {}, [replace(STILL, brightness_change=change)])
    assert item.status == status
    assert "flicker" in item.advice


def test_light_that_changes_while_a_camera_moves_is_told_of_whole_scans_alone():
    camera = load_profile("sim-scan").camera
    item = judge_locks(camera, {}, [replace(STILL, brightness_change=0.3, exposures_s=(0.008,))])
    assert (item.status, item.advice) == ("pass", "")
    assert item.found == "exposure of 8.00 ms reported"


def multiview(time_s: float, number: int, skew_s: float = 0.0) -> MultiView:
    image = np.zeros((16, 16), np.uint8)
    return MultiView(
        (Frame("centre", image, time_s, number), Frame("left", image, time_s + skew_s, number))
    )


def test_rate_drops_and_missing_numbers_of_a_stream():
    """Ten frames per second; number 3 was dropped with a reason, 6 and 7 without one."""
    numbers = [0, 1, 2, 4, 5, 8, 9]
    stream = stream_of([multiview(0.1 * n, n) for n in numbers], {"skew": 1, "late": 0})
    assert stream.missing_numbers == 3
    item = judge_drops(stream)
    assert item.status == "fail"
    assert "1 skew, 2 missing in the sequence numbers" in item.found
    rate = judge_rate(stream, 10.0)
    assert rate.status == "warn"
    assert rate.numbers["reached_hz"] == pytest.approx(6 / 0.9)
    assert judge_rate(stream, None).status == "skip"


def test_a_stream_of_nothing_fails_and_one_without_loss_passes():
    assert judge_rate(stream_of([], {}), 10.0).status == "fail"
    good = stream_of([multiview(0.1 * n, n) for n in range(20)], {})
    assert judge_rate(good, 10.0).status == judge_drops(good).status == "pass"


def test_skew_is_judged_by_its_95th_percentile():
    assert judge_skew([0.0] * 99 + [0.02], 0.005).status == "pass"
    assert judge_skew([0.003] * 20, 0.005).status == "warn"
    assert judge_skew([0.006] * 20, 0.005).status == "fail"


def test_travel_covers_the_plan_or_not():
    assert judge_travel((400.0, 1200.0), (400.0, 1200.0)).status == "pass"
    assert judge_travel((399.0, 1200.0), (400.0, 1200.0)).status == "fail"


def arrivals(near_px: list[float], far_px: list[float], sigma_px: float) -> list[Arrival]:
    near = [Arrival(True, 800.004, slope, sigma_px) for slope in near_px]
    return near + [Arrival(False, 799.999, slope, sigma_px) for slope in far_px]


def test_play_and_spread_are_in_mm_with_their_sign():
    """At -0.04 px per mm a board 0.5 mm farther away has a slope 0.02 px smaller."""
    near, far = [2.0, 2.002, 1.998, 2.0, 2.0], [1.98, 1.982, 1.978, 1.98, 1.98]
    found = repeatability(800.0, arrivals(near, far, 0.001), -0.04)
    assert found.play_mm == pytest.approx(0.5)
    assert found.spread_mm == pytest.approx(np.std(near, ddof=1) / 0.04)
    assert found.resolved_mm == pytest.approx(0.025)
    assert found.read_back_mm == pytest.approx(0.004)
    item = judge_repeatability(found, PROFILE)  # 0.05 % of 800 mm: 0.4 mm
    assert item.status == "warn"
    assert "approach_mm above the play of 0.50 mm" in item.advice


def test_a_board_that_wobbles_fails():
    wobble = [2.0, 2.05, 1.95, 2.03, 1.97]
    item = judge_repeatability(
        repeatability(800.0, arrivals(wobble, wobble, 0.001), -0.04), PROFILE
    )
    assert item.status == "fail"
    assert "tighten" in item.advice


def test_scatter_that_the_cameras_noise_explains_passes():
    noise = [2.0, 2.01, 1.99, 2.005, 1.995]
    item = judge_repeatability(repeatability(800.0, arrivals(noise, noise, 0.01), -0.04), PROFILE)
    assert item.status == "pass"


@pytest.mark.parametrize(
    ("sigma_mm", "status"),
    [(0.133, "pass"), (0.134, "warn"), (0.4, "warn"), (0.401, "fail")],
)
def test_what_a_person_reads_is_judged_by_its_sigma(sigma_mm: float, status: str):
    item = judge_reading(sigma_mm, 800.0, PROFILE)  # 0.05 % of 800 mm: 0.4 mm
    assert (item.name, item.status) == ("repeatability", status)
    assert f"within {sigma_mm:.3f} mm (1 sigma, the profile says); allowed 0.400 mm" in item.found
    assert ("reading_sigma_mm" in item.advice) is (status != "pass")


def test_without_slopes_only_the_read_back_is_known():
    blind = [Arrival(place % 2 == 0, 800.0, None, None) for place in range(10)]
    item = judge_repeatability(repeatability(800.0, blind, None), PROFILE)
    assert item.status == "warn"
    assert "gave no slopes" in item.found


def test_a_slope_off_the_curve_is_told_in_mm():
    curve = RunCurve(7, fit_curve(exact_sweep()).best, sweep_id=5)
    at = {"distance_mm": 700.0, "sigma_px": 0.001}
    assert judge_curve_drift(curve, PROFILE, slope_px=physical_px(700.0), **at).status == "pass"
    moved = judge_curve_drift(curve, PROFILE, slope_px=physical_px(703.0), **at)
    assert moved.status == "fail"
    assert "+3.000 mm" in moved.found
    outside = judge_curve_drift(curve, PROFILE, slope_px=physical_px(2000.0), **at)
    assert outside.status == "fail"
    assert "outside curve 7" in outside.found
    none = judge_curve_drift(
        StoreError("no curve", advice="rig sweep"), PROFILE, slope_px=1.0, **at
    )
    assert none.status == "skip"


def test_room_for_a_sweep(tmp_path: Path):
    small = multiview(0.0, 0)
    url = f"sqlite:///{tmp_path}/rig.sqlite"
    assert judge_room(PROFILE, url, small).status == "pass"
    huge = MultiView((replace(small.frames[0], image=_VAST),))
    item = judge_room(PROFILE, url, huge)
    assert item.status == "fail"
    assert "RIG_FRAMES" in item.advice


_VAST = np.lib.stride_tricks.as_strided(
    np.zeros(1, np.uint8), shape=(2**24, 2**24), strides=(0, 0), writeable=False
)
"""A picture of 281 TB that takes up one byte."""


SHOT = tuple(
    replace(STILL, view=name, noise=PhotonTransfer(electrons, 0.6, 0.95))
    for name, electrons in (("left", 20.0), ("centre", 25.0), ("right", 30.0))
)


def test_the_noise_of_light_is_told_as_a_line_for_the_profile():
    item = judge_noise(SHOT, None)
    assert item.status == "pass"
    assert "camera.noise = { read_noise_levels = 0.60, electrons_per_level = 25 }" in item.found


def test_a_profile_that_tells_the_noise_that_is_there_passes():
    told = NoiseConfig(read_noise_levels=0.8, electrons_per_level=24.0)
    item = judge_noise(SHOT, told)
    assert (item.status, item.advice) == ("pass", "")
    assert "for the profile" not in item.found


def test_a_profile_that_tells_another_noise_is_a_warning():
    item = judge_noise(SHOT, NoiseConfig(read_noise_levels=0.6, electrons_per_level=80.0))
    assert item.status == "warn"
    assert "electrons_per_level = 25" in item.advice


def test_noise_that_does_not_grow_with_light_is_no_line_for_the_profile():
    bent = replace(SHOT[1], noise=PhotonTransfer(25.0, 0.6, 0.2))
    assert "camera.noise" not in judge_noise((SHOT[0], bent, SHOT[2]), None).found
