"""Every method on the same multi-views: density, time, and agreement with ours."""

import statistics
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.compare.baselines import BASELINES, FILLED, OURS, Map, Method, rows_met
from rig.compare.pair import Span, best_pair
from rig.curve_rows import expecting_rows, require_same_rows
from rig.epipolar import RectifiedViews, estimate_slopes
from rig.epipolar.mending.row_errors import RowErrors
from rig.errors import SlopeError
from rig.frames import GreyImage, MultiView
from rig.stored import Run

METHODS = (OURS, *BASELINES, *FILLED)
_REPEATS = 3
"""Timed runs per method and multi-view; their median leaves out what disturbed one of them."""


@dataclass(frozen=True, slots=True)
class FrameScore:
    """One method on all multi-views."""

    method: str
    density_pct: float
    """Pixels with an answer; with a curve an answer is a depth."""
    duration_ms: float
    """Median over the timed runs on all multi-views."""
    agreement_pct: float
    """Of the pixels that both answer: disparities of the pair within 1 px of ours."""
    difference_px: float
    """Median absolute difference to our disparities, over the same pixels."""


@dataclass(frozen=True, slots=True)
class FrameComparison:
    """All methods on the same multi-views, and what the first of these looked like."""

    count: int
    range_px: Span
    """Slopes that were searched."""
    partner: str
    """Name of the view that makes the stereo pair with the reference view."""
    baseline_steps: float
    disparities_px: tuple[int, int]
    """First and last disparity that the matchers search."""
    scores: tuple[FrameScore, ...]
    image: GreyImage
    """(H, W) reference view of the first multi-view."""
    maps: Mapping[str, Map]
    """By method, of the first multi-view: depth in mm with a curve, else slope in px."""


@dataclass(frozen=True, slots=True)
class _Frame:
    """Rectified views of one multi-view."""

    views: RectifiedViews
    """For ours, which mends rows itself."""
    mended: RectifiedViews
    """For the matchers: rows are brought together as ours brings them."""

    @classmethod
    def of(cls, run: Run, multiview: MultiView) -> "_Frame":
        """Rectify a multi-view and bring its rows together; see `compare_frames`."""
        views = expecting_rows(run, run.optics.views(multiview.images))
        found = estimate_slopes(views, run.range_px).mending
        require_same_rows(run, found)
        if found is None or len(found.rows.fields) != len(views.images):
            rows = views.row_errors or RowErrors.none(len(views.images))
        else:
            rows = found.rows
        return cls(views, rows_met(views, rows))

    def slopes_px(self, method: Method, slope_range_px: Span) -> Map:
        """Slopes by one of the methods."""
        return method.run(self.views if method is OURS else self.mended, slope_range_px)


def compare_frames(run: Run, multiviews: Iterable[MultiView]) -> FrameComparison:
    """Run every method on every multi-view.

    Args:
        run: the rig; all methods get its rectified views with the same rows and search the
            run's range of slopes. Without a curve slopes are compared only.
        multiviews: one or more.

    Raises:
        CurveError: rows miss otherwise than when the curve was made.
        SlopeError: there was no multi-view, it holds no stereo pair, or images give no slopes.
    """
    profile, series = run.profile, tuple(multiviews)
    if not series:
        raise SlopeError(
            f"asked {profile.name} for multi-views to compare on, none came whose views lie "
            f"within {1e3 * profile.camera.max_skew_s:.1f} ms",
            advice="check the camera and its sync",
        )
    frames = [_Frame.of(run, multiview) for multiview in series]
    pair = best_pair(frames[0].mended)
    range_px = run.range_px
    first_px, count = pair.disparities(range_px)
    slopes, durations_s = _run_all(frames, range_px)
    scores: list[FrameScore] = []
    for method in METHODS:
        slopes_px, ours = np.stack(slopes[method.name]), np.stack(slopes[OURS.name])
        answers = [_answer(run, one) for one in slopes_px]
        gap_px = np.abs(slopes_px - ours) * pair.baseline_steps
        gap_px = gap_px[np.isfinite(gap_px)]
        scores.append(
            FrameScore(
                method=method.name,
                density_pct=100.0 * float(np.isfinite(answers).mean()),
                duration_ms=1e3 * statistics.median(durations_s[method.name]),
                agreement_pct=100.0 * float((gap_px <= 1.0).mean()) if gap_px.size else np.nan,
                difference_px=float(np.median(gap_px)) if gap_px.size else np.nan,
            )
        )
    shown = {name: each[0] for name, each in slopes.items()}
    return FrameComparison(
        count=len(series),
        range_px=range_px,
        partner=profile.views[pair.partner].name,
        baseline_steps=pair.baseline_steps,
        disparities_px=(first_px, first_px + count - 1),
        scores=tuple(scores),
        image=run.optics.pictures(series[0].images)[profile.reference],
        maps={name: _answer(run, one) for name, one in shown.items()},
    )


def _answer(run: Run, slope_px: Map) -> Map:
    """Depth of a map of slopes with a curve, the slopes themselves without one."""
    if run.curve is None:
        return slope_px
    curve = run.curve.curve
    return curve.depth_mm(curve.without_field(run.optics.axis_slopes_px(slope_px)))


def _run_all(
    frames: Sequence[_Frame], slope_range_px: Span
) -> tuple[dict[str, list[Map]], dict[str, list[float]]]:
    """Slopes of every method on every frame, and the times of the runs after a first one.

    The methods take turns, so that what else the computer does slows all of them alike.
    """
    slopes: dict[str, list[Map]] = {method.name: [] for method in METHODS}
    durations_s: dict[str, list[float]] = {method.name: [] for method in METHODS}
    for frame in frames:
        for method in METHODS:
            slopes[method.name].append(frame.slopes_px(method, slope_range_px))
        for method in METHODS * _REPEATS:
            begun_s = time.perf_counter()
            frame.slopes_px(method, slope_range_px)
            durations_s[method.name].append(time.perf_counter() - begun_s)
    return slopes, durations_s
