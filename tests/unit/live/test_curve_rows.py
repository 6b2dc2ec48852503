"""A curve and the rows that it was made with: carried on, mended, or refused."""

from contextlib import nullcontext
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from rig_sim.clock import VirtualClock

from rig.compare.frames import compare_frames
from rig.curve import fit_curve
from rig.epipolar.mending.corner_rows import CornersBeside, rows_of_corners
from rig.epipolar.mending.row_errors import RowErrors
from rig.errors import CurveError
from rig.frames import Frame, MultiView
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.optics.nominal import nominal_optics
from rig.profile.load import load_profile
from rig.stored import Run, RunCurve
from tests.support.curve_points import exact_sweep
from tests.unit.live.test_following import SHAPE, Sequence, multiview, scene

PROFILE = load_profile("sim", ["slopes.range_px=[-8.0, 12.0]"])
NAMES = tuple(view.name for view in PROFILE.views)
RIGHT = NAMES.index("right")


def low_px(x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
    """By how much the right view lies low where its rows miss: 1.3 px at the bottom left."""
    return 0.9 + 0.2 * (y_px / 60.0 - 1.0) - 0.2 * (x_px / 80.0 - 1.0)


@cache
def frames(misses: bool, number: int = 0) -> MultiView:
    taken = multiview(PROFILE, scene(-4.0, 6.0, left=True), number)
    if not misses:
        return taken
    columns, rows = np.meshgrid(np.arange(160.0), np.arange(120.0))
    moved = cv2.remap(
        np.asarray(taken.frames[RIGHT].image), columns.astype(np.float32),
        (rows - low_px(columns, rows)).astype(np.float32), cv2.INTER_LANCZOS4,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    changed = list(taken.frames)
    changed[RIGHT] = Frame(
        NAMES[RIGHT], moved.astype(np.uint8), taken.frames[0].timestamp_s, number
    )
    return MultiView(tuple(changed))


def rows_of_sweep(misses: bool) -> RowErrors:
    """What a sweep of such a rig tells."""
    rng = np.random.default_rng(1)
    x_px, y_px = rng.uniform(0.0, 160.0, 900), rng.uniform(0.0, 120.0, 900)
    slope_px = np.linspace(-8.0, 12.0, 900)
    steps = np.array([[view.x_steps, view.y_steps] for view in PROFILE.views])
    corners = [
        None
        if i == PROFILE.reference
        else CornersBeside(
            x_px, y_px, slope_px,
            (low_px(x_px, y_px) if misses and i == RIGHT else 0.0)
            + 0.01 * rng.standard_normal(900),
        )
        for i in range(len(NAMES))
    ]  # fmt: skip
    return rows_of_corners(corners, steps[:, 0], steps[:, 1], SHAPE)


def run(row_errors: RowErrors | None) -> Run:
    curve = RunCurve(3, fit_curve(exact_sweep()).best, sweep_id=5, row_errors=row_errors)
    return Run(PROFILE, nominal_optics(PROFILE), curve)


def captured(row_errors: RowErrors | None, *, misses: bool) -> list[DepthFrame]:
    device = Sequence(NAMES, [frames(misses, number) for number in range(2)])
    with DepthCamera(run(row_errors), lambda: nullcontext((device, VirtualClock()))) as camera:
        return list(camera)


@pytest.mark.slow
def test_a_curve_made_without_mending_is_refused_where_rows_miss():
    with pytest.raises(
        CurveError,
        match=r"curve 3 was made without mending of rows, this rig's rows miss: right is 1\.\d px "
        r"low at the .*; slopes may be off by \d\.\d+ px, the curve knows them to .*`rig fit 5`",
    ):
        captured(None, misses=True)


@pytest.mark.slow
def test_a_curve_that_a_program_brought_is_named_as_such():
    brought = replace(run(None), curve=RunCurve(None, fit_curve(exact_sweep()).best, None))
    device = Sequence(NAMES, [frames(misses=True)])
    with (
        DepthCamera(brought, lambda: nullcontext((device, VirtualClock()))) as camera,
        pytest.raises(CurveError, match=r"^the curve that was given was made .*; sweep again$"),
    ):
        list(camera)


@pytest.mark.slow
@pytest.mark.parametrize("looked", [False, True])
def test_a_curve_serves_where_rows_meet(looked: bool):
    first, second = captured(rows_of_sweep(misses=False) if looked else None, misses=False)
    assert first.valid_share > 0.9
    assert second.slopes.mending is None or not second.slopes.mending.rows.any


@pytest.mark.slow
def test_rows_that_miss_as_they_did_in_the_sweep_are_mended_from_the_start():
    known = rows_of_sweep(misses=True)
    first, second = captured(known, misses=True)
    assert first.slopes.mending is not None
    assert first.slopes.mending.rows.rms_px[RIGHT] == pytest.approx(0.9, abs=0.15)
    assert any(told.startswith("rows: view 2") for told in first.slopes.warnings)
    straight = captured(rows_of_sweep(misses=False), misses=False)
    for bent, right in zip((first, second), straight, strict=True):
        apart = np.abs(bent.slopes.slope_px - right.slopes.slope_px)
        assert np.nanmedian(apart) < 0.03
        assert bent.valid_share > right.valid_share - 0.05


@pytest.mark.parametrize("missed_then", [True, False])
def test_a_rig_whose_rows_have_moved_since_the_sweep_is_refused(missed_then: bool):
    with pytest.raises(
        CurveError, match=r"otherwise than when curve 3 was made: right is .*`rig sweep sim` again"
    ):
        captured(rows_of_sweep(missed_then), misses=not missed_then)


def test_a_comparison_refuses_the_same_curves():
    with pytest.raises(CurveError, match="made without mending of rows"):
        compare_frames(run(None), [frames(misses=True)])


@pytest.mark.slow
def test_matchers_get_the_rows_that_ours_gets():
    slopes_only = replace(run(None), curve=None)
    bent = compare_frames(slopes_only, [frames(misses=True)])
    straight = compare_frames(slopes_only, [frames(misses=False)])
    for one, other in zip(bent.scores, straight.scores, strict=True):
        assert one.method == other.method
        assert one.density_pct > other.density_pct - 8.0
        assert one.agreement_pct > other.agreement_pct - 3.0
