"""Judgements of pictures at their limits: what is just allowed, what is just not."""

import math
from dataclasses import replace

import pytest

from rig.check.items import graded
from rig.check.locks import judge_locks, unlocked
from rig.check.noise import judge_noise
from rig.check.photon_transfer import PhotonTransfer
from rig.check.pictures import judge_board, judge_exposure, judge_focus, judge_likeness
from rig.check.stills import Exposure, ViewStills
from rig.errors import TargetError
from rig.profile import NoiseConfig
from rig.profile.load import load_profile
from tests.unit.check.stills import PROFILE, STILL, board, named


def test_a_limit_itself_is_still_allowed():
    limits = {"warn_above": 1.0, "fail_above": 2.0}
    assert [graded(value, **limits) for value in (1.0, 1.01, 2.0, 2.01)] == [
        "pass",
        "warn",
        "warn",
        "fail",
    ]


def test_two_exposures_within_a_hundredth_are_one_setting():
    one = replace(STILL, exposures_s=(0.008, 0.008 * 1.01))
    item = judge_locks(PROFILE.camera, {}, [one, replace(STILL, exposures_s=(0.007,))])
    assert (item.status, item.advice) == ("pass", "")
    assert item.found == "exposure of 7.00, 8.00 ms reported; brightness steady within 0.1%"


def test_a_camera_that_does_not_report_its_exposure_is_told():
    item = judge_locks(PROFILE.camera, {}, [replace(STILL, exposures_s=(), brightness_change=0.02)])
    assert item.status == "pass"
    assert item.found == "the camera does not report its exposure; brightness steady within 2.0%"


def test_the_least_steady_view_counts():
    item = judge_locks(PROFILE.camera, {}, [STILL, replace(STILL, brightness_change=0.05)])
    assert (item.status, item.found.split("; ")[-1]) == ("warn", "brightness steady within 5.0%")


def test_what_could_be_locked_is_what_the_controls_name():
    camera = load_profile("v4l2-pair-grbl", ["camera.gain=16"]).camera
    assert unlocked(camera, {"controls": "focus_absolute gain"}) == ["focus"]
    assert unlocked(camera, {"left.controls": "focus_absolute gain"}) == ["focus"]
    assert unlocked(camera, {"model": "focus"}) == []


def with_noise(
    electrons: float, read_levels: float = 0.0, straightness: float = 0.95
) -> ViewStills:
    return replace(STILL, noise=PhotonTransfer(electrons, read_levels, straightness))


def test_noise_is_judged_against_the_contrast_of_the_board():
    """On white 190 with black 20: 190 / e + 1/12 is the variance, 0.03 of 170 are 5.1 levels."""
    item = judge_noise([with_noise(20.0)], None)
    assert item.status == "pass"
    assert item.found.startswith("left 3.1 levels on white (20.0 e/level, read 0.00 levels)")
    assert item.numbers == {
        "electrons_per_level": {"left": 20.0},
        "read_noise_levels": {"left": 0.0},
    }
    loud = judge_noise([with_noise(5.86)], None)  # 5.7 levels: 0.0335 of the contrast
    assert (loud.status, loud.advice) == (
        "warn",
        "left: add light, or lower the gain and expose longer",
    )
    assert judge_noise([with_noise(0.5)], None).status == "fail"


def test_noise_of_light_begins_at_the_straightness_that_is_asked_for():
    assert judge_noise([with_noise(20.0, straightness=0.6)], None).status == "pass"
    bent = judge_noise([with_noise(20.0, straightness=0.59)], None)
    assert bent.status == "warn"
    assert "switch compression" in bent.advice
    assert judge_noise([with_noise(math.inf, 1.0)], None).status == "warn"
    assert judge_noise([with_noise(-1e6, 2.0)], None).status == "warn"


def test_one_view_without_noise_is_told_and_only_all_of_them_ask_for_a_board():
    some = judge_noise([with_noise(20.0), replace(STILL, view="right")], None)
    assert some.status == "warn"
    assert "right: no even areas" in some.found
    assert "for the profile" not in some.found
    assert "put the board in view" not in some.advice
    assert "put the board in view" in judge_noise([STILL], None).advice


@pytest.mark.parametrize(
    ("electrons", "status"), [(10.0, "warn"), (14.0, "pass"), (30.0, "pass"), (40.0, "warn")]
)
def test_a_profile_may_be_wrong_by_a_quarter_either_way(electrons: float, status: str):
    """20 e measured: the noise is the root of the inverse, 0.71, 0.84, 1.22 and 1.41 times it."""
    told = NoiseConfig(read_noise_levels=0.0, electrons_per_level=electrons)
    assert judge_noise([with_noise(20.0)], told).status == status


def test_boards_that_are_found_and_those_that_are_not_are_counted():
    views = named()
    assert judge_board([*views.values()], "here").found == "found in all 3 views here"
    lost = replace(STILL, view="top", board=TargetError("none", reason="not-found"))
    item = judge_board([*views.values(), lost], "here")
    assert item.status == "fail"
    assert item.found.startswith("not found in 1 of 4 views here: top: ")
    assert item.numbers == {"reason": {"top": "not-found"}}


@pytest.mark.parametrize(
    ("blur_px", "status", "named_views"),
    [
        ((0.8, 0.8, 0.8), "pass", ""),
        ((0.8, 0.8, 1.5 * 0.8), "pass", ""),  # just as uneven as allowed
        ((0.8, 0.8, 1.3), "warn", "right"),  # sharp enough, yet unlike the others
        ((1.5, 1.5, 1.5), "pass", ""),
        ((1.6, 1.6, 1.6), "warn", "left, centre, right"),
        ((3.0, 3.0, 3.0), "warn", "left, centre, right"),
        ((0.8, 0.8, 4.0), "fail", "right"),
    ],
)
def test_focus_is_judged_by_each_view_and_against_the_others(
    blur_px: tuple[float, ...], status: str, named_views: str
):
    views = [
        replace(view, board=board(px)) for view, px in zip(named().values(), blur_px, strict=True)
    ]
    item = judge_focus(views)
    assert item.status == status
    wanted = f"focus {named_views} on the middle of the travel and lock the lens"
    assert item.advice == (wanted if named_views else "")


def test_edges_too_blurred_to_measure_fail_and_no_board_at_all_is_skipped():
    blurred = replace(STILL, view="top", board=TargetError("soft", reason="blurred"))
    item = judge_focus([STILL, blurred])
    assert (item.status, item.found.endswith("too blurred to measure in top")) == ("fail", True)
    nothing = replace(STILL, board=TargetError("none", reason="not-found"))
    assert judge_focus([nothing]).status == "skip"


@pytest.mark.parametrize(
    ("exposure", "status", "found"),
    [
        (Exposure(255.0, 190.0, 20.0, 0.005, 0.005), "pass", "left 8%-75%"),
        (Exposure(255.0, 190.0, 20.0, 0.006, 0.0), "warn", "left 8%-75% with 0.6% saturated"),
        (Exposure(255.0, 190.0, 20.0, 0.05, 0.0), "warn", "left 8%-75% with 5.0% saturated"),
        (Exposure(255.0, 190.0, 20.0, 0.06, 0.0), "fail", "left 8%-75% with 6.0% saturated"),
        (Exposure(255.0, 190.0, 20.0, 0.0, 0.3), "warn", "left 8%-75% with 30.0% at zero"),
        (Exposure(100.0, 25.0, 5.0, 0.0, 0.0), "pass", "left 5%-25%"),
        (Exposure(100.0, 24.0, 5.0, 0.0, 0.3), "warn", "left 5%-24%"),
        (Exposure(100.0, 12.0, 5.0, 0.0, 0.0), "warn", "left 5%-12%"),
        (Exposure(100.0, 11.0, 5.0, 0.0, 0.0), "fail", "left 5%-11%"),
    ],
)
def test_exposure_is_judged_at_both_ends_of_the_scale(exposure: Exposure, status: str, found: str):
    item = judge_exposure([replace(STILL, exposure=exposure)])
    assert (item.status, item.found) == (status, f"black to white, of full scale: {found}")
    assert bool(item.advice) == (status != "pass")


def test_too_dark_and_too_bright_have_their_own_advice():
    dark = replace(STILL, exposure=Exposure(100.0, 20.0, 5.0, 0.0, 0.3))
    burnt = replace(STILL, view="top", exposure=Exposure(100.0, 90.0, 5.0, 0.1, 0.0))
    item = judge_exposure([dark, burnt])
    assert item.advice == (
        "left: lengthen the exposure or add light; "
        "top: shorten the exposure, lower the gain, or dim the light"
    )
    assert item.numbers == {"saturated_share": {"left": 0.0, "top": 0.1}}


def test_views_are_alike_within_a_quarter_of_the_contrast():
    views = named()
    views["right"] = replace(
        views["right"], exposure=Exposure(255.0, 45.5 + 1.25 * 170.0, 45.5, 0.0, 0.0)
    )
    item = judge_likeness([*views.values()])
    assert (item.status, item.advice) == ("pass", "")
    assert item.found == (
        "contrast over its median: left 1.00, centre 1.00, right 1.25; "
        "black against left: left +0.0%, centre +0.0%, right +10.0%"
    )
    assert item.numbers["contrast_ratio"] == {"left": 1.0, "centre": 1.0, "right": 1.25}


@pytest.mark.parametrize(("contrast", "status"), [(100.0, "warn"), (80.0, "fail")])
def test_a_view_with_less_contrast_is_named(contrast: float, status: str):
    views = named()
    views["centre"] = replace(
        views["centre"], exposure=Exposure(255.0, 20.0 + contrast, 20.0, 0.0, 0.0)
    )
    item = judge_likeness([*views.values()])
    assert item.status == status
    assert item.advice == "give centre the exposure, gain and aperture of the others"


def test_one_board_is_like_no_other():
    assert judge_likeness([STILL]).status == "skip"
    assert judge_likeness([STILL, replace(STILL, view="right")]).status == "pass"
