"""Everything that needs the board at known distances: reach, repeatability, drift of the curve."""

from collections.abc import Iterator, Sequence

from rig.check.bench import Bench, BoardAtStop
from rig.check.curve_drift import judge_curve_drift
from rig.check.items import Item, failed
from rig.check.reach import Reach, judge_reach, predict_reach
from rig.check.span import ends_mm, middle_mm, plan_mm
from rig.check.stage import judge_reading, judge_repeatability, repeatability
from rig.errors import DeviceError, RigError
from rig.optics.optics import Optics
from rig.profile import CharucoConfig, CheckerboardConfig, Profile
from rig.stored import RunCurve
from rig.targets.corners import Corners

ARRIVALS = 10
"""Moves from which the repeatability comes."""
STEP_MM = 40.0
"""How far the stage goes away between two arrivals."""


def judge_carried_board(
    bench: Bench, middle: BoardAtStop, curve: RunCurve | RigError
) -> Iterator[Item]:
    """Carry the board through the plan and judge what depends on where it stands.

    Args:
        bench: homed.
        middle: the board in the middle of the plan.
        curve: newest of the rig, or why there is none.
    """
    profile = bench.profile
    yield judge_curve(profile, bench.optics, middle, curve)
    near_mm, far_mm = ends_mm(profile)
    try:
        near, far = bench.look(near_mm), bench.look(far_mm)
    except DeviceError as error:
        yield failed("reach", error)
        return
    yield judge_places(profile, [near, middle, far])
    wanted_mm, step_mm = middle_mm(profile), min(STEP_MM, (far_mm - near_mm) / 4.0)
    if profile.stage is not None and profile.stage.distance_sigma_mm:
        yield judge_reading(profile.stage.distance_sigma_mm, wanted_mm, profile)
        return
    try:
        arrivals = list(bench.arrivals(wanted_mm, step_mm, ARRIVALS))
    except DeviceError as error:
        yield failed("repeatability", error)
        return
    comes_back = repeatability(wanted_mm, arrivals, _slope_per_mm(profile, middle))
    yield judge_repeatability(comes_back, profile)


def judge_places(profile: Profile, boards: Sequence[BoardAtStop]) -> Item:
    """Judge where in the plan each view sees the board, from pictures at known distances."""
    images = boards[0].multiview.images
    reaches: list[Reach] = []
    for place, view in enumerate(profile.views):
        corners_at_mm = {
            board.reached_mm: corners
            for board in boards
            if isinstance(corners := board.by_view[place], Corners)
        }
        if corners_at_mm:
            size_px = (images[place].shape[1], images[place].shape[0])
            reach = predict_reach(
                view.name, corners_at_mm, plan_mm=plan_mm(profile), size_px=size_px
            )
            reaches.append(reach)
    return judge_reach(
        reaches,
        reference=profile.views[profile.reference].name,
        plan_mm=plan_mm(profile),
        visited_mm=[board.reached_mm for board in boards],
    )


def judge_curve(
    profile: Profile, optics: Optics, board: BoardAtStop, curve: RunCurve | RigError
) -> Item:
    """Judge the newest curve by one picture of the board at a known distance."""
    if board.slope is None:
        return Item("curve", "skip", "needs the slope of the board")
    slope_px, _, _ = optics.axis_plane(board.slope.plane, board.slope.centre_px)
    if not isinstance(curve, RigError) and curve.curve.field is not None:
        slope_px -= curve.curve.field.slope_px(*board.slope.centre_px)
    return judge_curve_drift(
        curve,
        profile,
        distance_mm=optics.distance_mm(board.reached_mm),
        slope_px=slope_px,
        sigma_px=board.slope.sigma_px,
    )


def _slope_per_mm(profile: Profile, board: BoardAtStop) -> float | None:
    """Change of the slope per mm of distance, from the size of the board in the picture alone.

    m = pitch f (1/Z - 1/Z0), and a square of s mm is f s / Z px wide: dm/dZ = -pitch side / (s Z).
    """
    target = profile.target
    if board.slope is None or not isinstance(target, CheckerboardConfig | CharucoConfig):
        return None
    return -profile.pitch_mm * board.slope.side_px / (target.square_mm * board.reached_mm)
