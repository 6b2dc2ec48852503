"""Stops without a slope: one line per kind."""

from dataclasses import replace

from rig.plan import Stop
from rig.sweep.misses import misses
from rig.sweep.points import StopResult

LIT = StopResult(
    stop=Stop(0, 400.0, "fit", "forward"),
    point=None,
    corner_slope_px=None,
    dense_slope_px=None,
    track_residual_px=None,
    motion_px=None,
    epipolar=None,
    centre_px=None,
    tilt=None,
    tilt_sigma=None,
    problem=None,
)


def stop(index: int, why: str | None) -> StopResult:
    planned = Stop(index, 400.0 + 50.0 * index, "fit", "forward" if index % 2 else "backward")
    place = f"stop {index} at {planned.distance_mm:.1f} mm ({planned.direction})"
    return replace(LIT, stop=planned, problem=None if why is None else f"{place}: {why}")


def test_stops_that_miss_alike_are_one_line_with_the_span_of_their_numbers():
    found = misses(
        [
            stop(0, None),
            stop(1, "the board moved 0.250 px, allowed 0.100 px; raise sweep.settle_s"),
            stop(2, "found 3 of 54 corners"),
            stop(3, "the board moved 0.125 px, allowed 0.100 px; raise sweep.settle_s"),
            stop(4, "the board moved 1.500 px, allowed 0.100 px; raise sweep.settle_s"),
        ]
    )
    assert found == (
        "3 stops at 450.0 (forward), 550.0 (forward), 600.0 (backward) mm: the board moved "
        "0.125 to 1.500 px, allowed 0.100 px; raise sweep.settle_s",
        "stop 2 at 500.0 mm (backward): found 3 of 54 corners",
    )


def test_many_stops_are_counted_and_no_miss_is_no_line():
    assert misses([stop(0, None)]) == ()
    (line,) = misses([stop(index, "too dark") for index in range(15)])
    assert line.startswith("15 stops at 400.0 (backward), 450.0 (forward), ")
    assert line.endswith("950.0 (forward) and 3 more mm: too dark")
