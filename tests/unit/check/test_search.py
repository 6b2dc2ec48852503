"""What the pre-flight says of the distances that a profile looks for."""

import pytest

from rig.check.search import judge_range
from rig.curve import Curve
from rig.curve.physical import Physical
from rig.errors import StoreError
from rig.optics.nominal import nominal_optics
from rig.profile.load import load_profile
from rig.run import Run, RunCurve

NONE = StoreError("asked for the curve of rig sim, found none", advice="sweep")
VARIANCE = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.01))
CURVE = RunCurve(4, Curve(Physical(0.0, 24000.0, -10.0), VARIANCE, (400.0, 1200.0), 0.0), 7)


def run_of(near_mm: float, far_mm: float, name: str = "sim") -> Run:
    profile = load_profile(name, [f"slopes.range_mm=[{near_mm}, {far_mm}]"])
    return Run(profile, nominal_optics(profile))


def test_distances_within_the_curve_pass_with_their_slopes():
    item = judge_range(run_of(480.0, 1200.0), CURVE)
    assert (item.name, item.status, item.advice) == ("range", "pass", "")
    assert item.numbers["range_mm"] == [480.0, 1200.0]
    low_px, high_px = item.numbers["range_px"]  # pyright: ignore[reportGeneralTypeIssues]
    assert low_px == pytest.approx(10.0, abs=1.5)
    assert high_px == pytest.approx(40.0, abs=1.5)
    assert item.found.startswith("480-1200 mm are slopes of ")
    assert item.found.endswith("px, by curve 4")


@pytest.mark.parametrize("span_mm", [(300.0, 1200.0), (400.0, 1300.0)])
def test_distances_beyond_the_curve_are_told(span_mm: tuple[float, float]):
    item = judge_range(run_of(*span_mm), CURVE)
    assert item.status == "warn"
    assert "valid 400-1200 mm only" in item.found
    assert "no depth" in item.advice


def test_distances_that_nothing_knows_or_that_the_curve_never_sees_fail():
    assert judge_range(run_of(400.0, 1200.0), NONE).status == "fail"
    assert judge_range(run_of(2000.0, 3000.0), CURVE).status == "fail"


def test_what_only_the_device_may_know_is_left_open():
    run = run_of(400.0, 1200.0, "oak-d")
    waiting = Run(run.profile, run.optics, awaits="slopes")
    item = judge_range(waiting, NONE)
    assert item.status == "skip"
    assert "the device's own calibration" in item.found
    assert judge_range(waiting, CURVE).status == "pass"
