"""Judgements of places, times, stage and curve at their limits, and the numbers they tell."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rig.check.arrangement import judge_arrangement
from rig.check.curve_drift import judge_curve_drift
from rig.check.span import ends_mm, middle_mm, plan_mm
from rig.check.stage import (
    Arrival,
    Repeatability,
    judge_repeatability,
    judge_travel,
    repeatability,
)
from rig.check.timing import (
    Stream,
    judge_drops,
    judge_rate,
    judge_settling,
    judge_skew,
    stream_of,
)
from rig.curve import fit_curve
from rig.frames import Frame, MultiView
from rig.profile.load import load_profile
from rig.stored import RunCurve
from tests.support.curve_points import exact_sweep, physical_px
from tests.unit.check.stills import PROFILE, STILL, named


def arranged(*names: str, changes: tuple[str, ...] = ()) -> tuple[str, str]:
    """Status and words of these views of the simulated rig."""
    profile = load_profile("sim", changes)
    views = tuple(view for view in profile.views if view.name in names)
    item = judge_arrangement(profile.model_copy(update={"views": views}))
    return item.status, item.found


def test_the_places_of_the_views_are_told_by_line():
    status, found = arranged(
        "centre", "left", "right", changes=("views.left.x_steps=-1.0", "views.right.x_steps=1.0")
    )
    assert status == "warn"
    assert found == "views in steps, row: -1.00, +0.00, +1.00; evenly spaced: row"


def test_two_views_to_a_line_are_told_and_three_of_one_line_are_enough():
    assert arranged("centre", "left")[1].endswith("; two views to a line cannot tell a repeating "
                                                  "pattern from its shift")  # fmt: skip
    assert "two views" not in arranged("centre", "left", "right", "top")[1]
    assert "two views" in arranged("centre", "left", "top")[1]
    assert arranged("centre")[1] == "views in steps, 1 views on neither row nor column of the " + (
        "reference"
    )


@pytest.mark.parametrize(("right", "status"), [(1.015, "warn"), (0.985, "warn"), (1.025, "pass")])
def test_a_fiftieth_of_a_step_off_even_is_even(right: float, status: str):
    changes = ("views.left.x_steps=-1.0", f"views.right.x_steps={right}")
    assert arranged("centre", "left", "right", changes=changes)[0] == status


def test_the_plan_runs_from_near_to_far_whichever_way_it_is_told():
    profile = load_profile("sim", ["sweep.from_mm=1100", "sweep.to_mm=450"])
    assert plan_mm(profile) == (450.0, 1100.0)


@pytest.mark.parametrize(
    ("travel_mm", "ends"),
    [
        ((500.0, 900.0), (500.0, 900.0)),
        ((100.0, 2000.0), (450.0, 1100.0)),
        ((600.0, 2000.0), (600.0, 1100.0)),
        ((1100.0, 2000.0), (1100.0, 2000.0)),  # one point in common is no span
        ((1200.0, 2000.0), (1200.0, 2000.0)),
    ],
)
def test_a_check_goes_where_plan_and_travel_agree(
    travel_mm: tuple[float, float], ends: tuple[float, float]
):
    profile = load_profile("sim", ["sweep.from_mm=450", "sweep.to_mm=1100"])
    assert profile.stage is not None
    stage = profile.stage.model_copy(update={"travel_mm": travel_mm})
    there = profile.model_copy(update={"stage": stage})
    assert ends_mm(there) == ends
    assert middle_mm(there) == (ends[0] + ends[1]) / 2
    assert ends_mm(profile.model_copy(update={"stage": None})) == (450.0, 1100.0)


def multiview(time_s: float, *numbers: int) -> MultiView:
    image = np.zeros((4, 4), np.uint8)
    frames = [Frame(f"view {n}", image, time_s, number) for n, number in enumerate(numbers)]
    return MultiView(tuple(frames))


def test_the_rate_of_a_stream_needs_two_times():
    assert Stream((1.0, 1.25), (), {}, 0).rate_hz == 4.0
    assert Stream((1.0,), (), {}, 0).rate_hz is None
    assert Stream((1.0, 1.0), (), {}, 0).rate_hz is None


def test_missing_numbers_are_those_of_the_view_that_misses_most():
    stream = stream_of(
        [multiview(0.0, 0, 0), multiview(0.1, 1, 3), multiview(0.2, 4, 7)], {"skew": 2, "late": 0}
    )
    assert stream.missing_numbers == 5
    assert stream.dropped == {"skew": 2}
    assert stream.times_s == (0.0, 0.1, 0.2)
    assert stream_of([multiview(0.0, 7)], {}).missing_numbers == 0
    assert stream_of([], {}).missing_numbers == 0


@pytest.mark.parametrize(
    ("skew_s", "status"), [(0.0025, "pass"), (0.005, "warn"), (0.0051, "fail")]
)
def test_half_of_the_skew_that_is_allowed_passes(skew_s: float, status: str):
    item = judge_skew([skew_s] * 20, 0.005)
    assert item.status == status
    assert bool(item.advice) == (status != "pass")
    assert judge_skew([], 0.005).status == "skip"


def test_skews_are_told_in_ms():
    item = judge_skew([0.0] * 10 + [0.001] * 11, 0.01)
    assert item.found.startswith("1.00 ms median, 1.00 ms 95th percentile, 1.00 ms at most; ")
    assert item.found.endswith("allowed 10.00 ms (21 multi-views)")
    assert item.numbers == {"p50_ms": 1.0, "p95_ms": 1.0, "max_ms": 1.0}


def stream(kept: int, missing: int = 0, **dropped: int) -> Stream:
    return Stream(tuple(0.1 * n for n in range(kept)), (), dropped, missing)


def test_half_of_the_rate_is_a_warning_and_less_fails():
    ten = Stream((0.0, 1.0), (), {}, 0)
    assert judge_rate(ten, 2.0).status == "warn"
    assert judge_rate(ten, 2.1).status == "fail"
    assert judge_rate(ten, 1.0).status == "pass"
    assert judge_rate(ten, 0.9).advice == ""
    assert judge_rate(ten, 2.0).numbers == {"reached_hz": 1.0, "asked_hz": 2.0}


def test_what_was_lost_is_a_share_of_all_that_were_exposed():
    item = judge_drops(stream(9, 2, skew=1))  # 2 of 11
    assert (item.status, bool(item.advice)) == ("warn", True)
    assert item.numbers == {"kept": 9, "dropped": {"skew": 1}, "unexplained": 1}
    assert judge_drops(stream(8, 2)).status == "warn"  # a fifth
    assert judge_drops(stream(7, 2)).status == "fail"
    one = judge_drops(stream(99, 1))
    assert (one.status, one.advice) == ("pass", "")  # a hundredth


def test_numbers_do_not_count_twice_what_was_dropped_with_a_reason():
    item = judge_drops(stream(10, 1, skew=3))
    assert item.numbers["unexplained"] == 0
    assert item.found == "10 multi-views kept, dropped: 3 skew"


@pytest.mark.parametrize(("motion_px", "status"), [(0.05, "pass"), (0.1, "warn"), (0.11, "fail")])
def test_settling_is_judged_by_the_view_that_moved_most(motion_px: float, status: str):
    views = named(motion_px=0.01)
    views["centre"] = replace(views["centre"], motion_px=motion_px)
    views["right"] = replace(views["right"], motion_px=None)
    item = judge_settling([*views.values()], settle_s=0.2, allowed_px=0.1)
    assert item.status == status
    assert item.found.startswith(f"corners moved {motion_px:.3f} px (view centre)")
    assert bool(item.advice) == (status != "pass")
    assert item.numbers["motion_px"] == {"left": 0.01, "centre": motion_px}
    assert judge_settling([STILL], settle_s=0.2, allowed_px=0.1).status == "skip"


def test_spread_and_play_of_unequal_numbers_of_arrivals():
    """At -0.5 px per mm: near at -2, -4, -6 mm, far at -10, -14 mm; variances 4 and 8."""
    arrivals = [
        *(Arrival(True, 800.0, slope, 0.01) for slope in (1.0, 2.0, 3.0)),
        *(Arrival(False, 800.2, slope, 0.03) for slope in (5.0, 7.0)),
        Arrival(False, 799.7, None, None),
    ]
    found = repeatability(800.0, arrivals, -0.5)
    assert found.arrivals == 6
    assert found.read_back_mm == pytest.approx(0.3)
    assert found.play_mm == pytest.approx(-12.0 - -4.0)
    variance = (2 * 4.0 + 1 * 8.0) / 3
    assert found.spread_mm == pytest.approx(math.sqrt(variance))
    assert found.play_sigma_mm == pytest.approx(math.sqrt(variance * (1 / 3 + 1 / 2)))
    assert found.resolved_mm == pytest.approx(0.01 / 0.5)


def test_one_arrival_from_a_side_has_no_spread():
    arrivals = [Arrival(n > 0, 800.0, 1.0, 0.01) for n in range(4)]
    found = repeatability(800.0, arrivals, -0.5)
    assert (found.spread_mm, found.play_mm, found.resolved_mm) == (None, None, None)
    nameless = [Arrival(n > 1, 800.0, 1.0, None) for n in range(4)]
    assert repeatability(800.0, nameless, -0.5).resolved_mm is None


def test_a_travel_must_cover_both_ends():
    item = judge_travel((400.0, 1200.5), (400.0, 1200.0))
    assert item.status == "fail"
    assert item.found == "plan from 400.0 to 1200.5 mm, travel from 400.0 to 1200.0 mm"
    assert "sweep.to_mm" in item.advice
    assert judge_travel((500.0, 1100.0), (400.0, 1200.0)).advice == ""


def returned(**changes: float | None) -> Repeatability:
    """At 800 mm the profile allows 0.05 %: 0.4 mm, of which a third, 0.133 mm, passes."""
    plain: dict[str, float | None] = {
        "spread_mm": 0.0, "resolved_mm": None, "play_mm": 0.0, "play_sigma_mm": 0.01,
    }  # fmt: skip
    return Repeatability(800.0, 10, 0.002, **(plain | changes))


@pytest.mark.parametrize(
    ("changes", "status", "advice"),
    [
        ({}, "pass", ""),
        ({"spread_mm": 0.13}, "pass", ""),
        ({"spread_mm": 0.14}, "warn", "tighten"),
        ({"spread_mm": 0.41}, "fail", "tighten"),
        ({"spread_mm": 0.5, "resolved_mm": 0.4}, "warn", "tighten"),  # 0.3 mm are the stage's own
        ({"spread_mm": 0.4, "resolved_mm": 0.5}, "pass", ""),
        ({"play_mm": 0.26}, "pass", ""),  # half of it counts
        ({"play_mm": -0.3}, "warn", "raise stage.approach_mm above the play of 0.30 mm"),
        ({"play_mm": 0.9}, "fail", "raise stage.approach_mm above the play of 0.90 mm"),
        ({"play_mm": 1.5, "play_sigma_mm": 0.5}, "pass", ""),  # three sigmas may be chance
    ],
)
def test_the_place_of_the_board_is_judged_by_the_error_that_is_allowed(
    changes: dict[str, float | None], status: str, advice: str
):
    item = judge_repeatability(returned(**changes), PROFILE)
    assert item.status == status
    assert item.advice.startswith(advice)
    told = [word for word in ("raise", "tighten") if word in item.advice]
    assert told == ([advice.split(maxsplit=1)[0]] if advice else [])
    assert item.numbers["allowed_mm"] == pytest.approx(0.4)


def test_play_and_wobble_have_both_their_advice():
    item = judge_repeatability(returned(play_mm=0.5, spread_mm=0.3), PROFILE)
    assert item.advice.startswith("raise stage.approach_mm above the play of 0.50 mm")
    assert "; tighten board" in item.advice
    assert "of which the camera's noise is 0.000 mm" in item.found
    assert "10 arrivals at 800.0 mm read back within 0.002 mm" in item.found


@pytest.mark.parametrize("lost", ["spread_mm", "play_mm", "play_sigma_mm"])
def test_what_the_camera_does_not_tell_is_no_judgement(lost: str):
    item = judge_repeatability(returned(**{lost: None}), PROFILE)
    assert (item.status, item.numbers) == ("warn", {})


@pytest.mark.parametrize(("sigma_px", "certain"), [(0.0001, True), (0.5, False)])
def test_an_error_is_allowed_by_the_gate_or_by_chance(sigma_px: float, certain: bool):
    curve = fit_curve(exact_sweep()).best
    item = judge_curve_drift(
        RunCurve(7, curve, sweep_id=5), PROFILE,
        distance_mm=700.0, slope_px=physical_px(703.0), sigma_px=sigma_px,
    )  # fmt: skip
    by_gate_mm = PROFILE.quality.holdout_max_pct / 100.0 * 700.0
    sigma_mm = curve.depth_sigma_mm(np.array([physical_px(703.0)]), np.array([sigma_px]))
    by_chance_mm = 3.0 * float(sigma_mm[0])
    assert (by_gate_mm > by_chance_mm) == certain
    assert item.numbers["allowed_mm"] == pytest.approx(by_gate_mm if certain else by_chance_mm)
    assert item.numbers["error_mm"] == pytest.approx(3.0, abs=1e-3)
    assert (item.status, bool(item.advice)) == (("fail", True) if certain else ("pass", False))
