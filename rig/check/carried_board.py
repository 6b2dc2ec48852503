"""Everything that needs the board at known distances: reach, repeatability, drift of the curve."""

from collections.abc import Iterator, Sequence

from rig.check.bench import Bench, Seen
from rig.check.curve_drift import judge_curve
from rig.check.items import Item, failed
from rig.check.reach import Reach, Sighted, judge_reach, predict_reach
from rig.check.span import ends_mm, middle_mm, plan_mm
from rig.check.stage import judge_repeatability, repeatability
from rig.errors import DeviceError, RigError
from rig.optics.optics import Optics
from rig.profile import Profile
from rig.stored import RunCurve
from rig.targets.corners import Corners

ARRIVALS = 10
"""Moves from which the repeatability comes."""
STEP_MM = 40.0
"""How far the stage goes away between two arrivals."""


def judge_over_travel(bench: Bench, middle: Seen, curve: RunCurve | RigError) -> Iterator[Item]:
    """Carry the board through the plan and judge what depends on where it stands.

    Args:
        bench: homed.
        middle: the board in the middle of the plan.
        curve: newest of the rig, or why there is none.
    """
    profile = bench.profile
    yield judge_drift(profile, bench.optics, middle, curve)
    near_mm, far_mm = ends_mm(profile)
    try:
        near, far = bench.look(near_mm), bench.look(far_mm)
    except DeviceError as error:
        yield failed("reach", error)
        return
    yield judge_seen(profile, [near, middle, far])
    wanted_mm, step_mm = middle_mm(profile), min(STEP_MM, (far_mm - near_mm) / 4.0)
    try:
        arrivals = list(bench.arrivals(wanted_mm, step_mm, ARRIVALS))
    except DeviceError as error:
        yield failed("repeatability", error)
        return
    found = repeatability(wanted_mm, arrivals, _slope_per_mm(profile, middle))
    yield judge_repeatability(found, profile)


def judge_seen(profile: Profile, seen: Sequence[Seen]) -> Item:
    """Judge where in the plan each view sees the board, from pictures at known distances."""
    image = seen[0].multiview.frames[0].image
    reaches: list[Reach] = []
    for place, view in enumerate(profile.views):
        sighted = [
            Sighted(at.reached_mm, sighting)
            for at in seen
            if isinstance(sighting := at.sightings[place], Corners)
        ]
        if sighted:
            size_px = (image.shape[1], image.shape[0])
            reach = predict_reach(view.name, sighted, plan_mm=plan_mm(profile), size_px=size_px)
            reaches.append(reach)
    return judge_reach(
        reaches,
        reference=profile.views[profile.reference].name,
        plan_mm=plan_mm(profile),
        visited_mm=[at.reached_mm for at in seen],
    )


def judge_drift(profile: Profile, optics: Optics, seen: Seen, curve: RunCurve | RigError) -> Item:
    """Judge the newest curve by one picture of the board at a known distance."""
    if seen.slope is None:
        return Item("curve", "skip", "needs the slope of the board")
    slope_px, _, _ = optics.axis_plane(seen.slope.plane, seen.slope.centre_px)
    if not isinstance(curve, RigError) and curve.curve.field is not None:
        slope_px -= curve.curve.field.slope_px(*seen.slope.centre_px)
    return judge_curve(
        curve,
        profile,
        distance_mm=optics.distance_mm(seen.reached_mm),
        slope_px=slope_px,
        sigma_px=seen.slope.sigma_px,
    )


def _slope_per_mm(profile: Profile, seen: Seen) -> float | None:
    """Change of the slope per mm of distance, from the size of the board in the picture alone.

    m = pitch f (1/Z - 1/Z0), and a square of s mm is f s / Z px wide: dm/dZ = -pitch side / (s Z).
    """
    if seen.slope is None or profile.target is None:
        return None
    return -profile.pitch_mm * seen.slope.side_px / (profile.target.square_mm * seen.reached_mm)
