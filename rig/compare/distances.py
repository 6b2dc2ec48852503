"""Error against distance: every method on the board of a sweep, judged by the stage."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compare.baselines import BASELINES, OURS, Map, rows_met
from rig.compare.pair import DISPARITY_BLOCK, Span, best_pair
from rig.curve import Curve
from rig.epipolar import RectifiedViews, SlopePrior, estimate_slopes
from rig.frames import MultiView
from rig.measurement import Measurement
from rig.optics.optics import Optics
from rig.optics.search_range import search_range_px
from rig.progress import Progress
from rig.records import Sample, SampleKey
from rig.stored import Run, RunCurve

WITH_PLANE = "rig, plane known"
"""Ours as a sweep runs it: the board's plane as a hypothesis."""
NAMES = (WITH_PLANE, OURS.name, *(method.name for method in BASELINES))
_PRIOR_SIGMA_PX = 0.25
_SPARE_DISPARITIES = 2


@dataclass(frozen=True, slots=True)
class BoardError:
    """One method on the board at one distance: what it says less what the stage says."""

    density_pct: float
    """Pixels of the board with an answer."""
    mean_mm: float
    """NaN, like all that follow, where no pixel has an answer."""
    median_mm: float
    spread_mm: float
    """Standard deviation over the pixels of the board."""


@dataclass(frozen=True, slots=True)
class BoardErrors:
    """All methods at one distance."""

    distance_mm: float
    """Of the stage, read back."""
    window_px: Span
    """The slopes that were searched."""
    errors: Mapping[str, BoardError]
    """By method."""


@dataclass(frozen=True, slots=True)
class BoardPlane:
    """Where the board is in one multi-view, from the stored line fit."""

    inside: NDArray[np.bool_]
    """(H, W) pixels within its outline."""
    plane_px: NDArray[np.float32]
    """(H, W) slopes of its plane."""
    centre_px: tuple[float, float]
    """(u, v) of its centre."""

    @classmethod
    def of(cls, measurement: Measurement, shape: tuple[int, int]) -> "BoardPlane | None":
        """Return the board of a measurement, None where it has no plane."""
        outline = measurement.outline_px
        if measurement.plane is None or measurement.centre_px is None or not outline:
            return None
        inside = np.zeros(shape, np.uint8)
        corners = np.round(np.asarray(outline, np.float64)).astype(np.int32)
        cv2.fillConvexPoly(inside, corners, 1)
        rows, columns = np.indices(shape)
        at_centre, per_column, per_row = measurement.plane
        u, v = measurement.centre_px
        plane = at_centre + per_column * (columns - u) + per_row * (rows - v)
        return cls(inside > 0, plane.astype(np.float32), (u, v))

    def window_px(self, baseline_steps: float) -> Span:
        """Slopes on the board, with room to make up one block of disparities on a flat board."""
        slopes_px = self.plane_px[self.inside]
        room_px = (DISPARITY_BLOCK / 2 - _SPARE_DISPARITIES) / baseline_steps
        return float(slopes_px.min()) - room_px, float(slopes_px.max()) + room_px


def compare_distances(
    run: Run,
    curve: RunCurve,
    samples: Sequence[Sample],
    measurements: Mapping[SampleKey, Measurement],
    load: Callable[[Sample], MultiView],
    progress: Progress,
) -> tuple[BoardErrors, ...]:
    """Measure the board at every distance with every method.

    Every method searches the same few slopes around the board's own, 8 disparities of the pair
    either way: a wider search locks onto wrong periods of the board, whatever the method. So the
    errors are those that remain when the period is known.

    Args:
        run: as the sweep was measured.
        curve: what turns slopes into distance, and what the rows of the views miss by: all methods
            get them brought together.
        samples: of a sweep; the first with a board at each distance is used.
        measurements: of the samples.
        load: reads the images of a sample.
        progress: told how many distances are done, and where.

    Raises:
        SlopeError: the views hold no stereo pair.
        StoreError: an image is missing or damaged.
    """
    optics = run.optics
    slope_range_px = search_range_px(run.profile, optics, curve.curve)
    errors: dict[float, BoardErrors] = {}
    for sample in samples:
        if sample.stop.distance_mm in errors or sample.key not in measurements:
            continue
        views = replace(optics.views(load(sample).images), row_errors=curve.row_errors)
        board = BoardPlane.of(measurements[sample.key], views.shape)
        if board is None:
            continue
        distance_mm = optics.distance_mm(sample.reached_mm)
        at_distance = _at_distance(optics, views, board, curve.curve, distance_mm, slope_range_px)
        errors[sample.stop.distance_mm] = at_distance
        progress(len(errors), f"board at {sample.reached_mm:.1f} mm")
    return tuple(sorted(errors.values(), key=lambda at_distance: at_distance.distance_mm))


def _at_distance(
    optics: Optics,
    views: RectifiedViews,
    board: BoardPlane,
    curve: Curve,
    distance_mm: float,
    slope_range_px: Span,
) -> BoardErrors:
    window_px = board.window_px(best_pair(views).baseline_steps)
    met = views if views.row_errors is None else rows_met(views, views.row_errors)
    slopes = {method.name: method.run(met, window_px) for method in BASELINES}
    slopes |= {OURS.name: OURS.run(views, window_px)}

    def on_axis(slope_px: Map) -> Map:
        return curve.without_field(optics.axis_slopes_px(slope_px))

    # What the tilt of the board, as the line fit has it, changes of the slope at its centre.
    u, v = board.centre_px
    tilt_px = on_axis(board.plane_px) - on_axis(board.plane_px)[round(v), round(u)]
    slopes[WITH_PLANE] = _with_plane(views, board, slope_range_px)
    return BoardErrors(
        distance_mm,
        window_px,
        {
            name: _board_error(on_axis(slopes[name]), tilt_px, board, curve, distance_mm)
            for name in NAMES
        },
    )


def _with_plane(views: RectifiedViews, board: BoardPlane, slope_range_px: Span) -> Map:
    plane_px = np.where(board.inside, board.plane_px, np.float32(np.nan))
    sigma_px = np.full(views.shape, _PRIOR_SIGMA_PX, np.float32)
    return estimate_slopes(views, slope_range_px, SlopePrior(plane_px, sigma_px)).slope_px


def _board_error(
    slope_px: Map, tilt_px: Map, board: BoardPlane, curve: Curve, distance_mm: float
) -> BoardError:
    """Bring the slopes of the board to its centre and turn what they miss into distance.

    The tilt of the board, as the line fit has it, is no error. Misses become distance at the rate
    of the curve there, as those of the curve's own stops do: near the ends of the curve half of the
    slopes lie just outside it, and leaving these out would hide half of the errors.
    """
    expected_px = curve.law.slope_px(np.array([distance_mm]))
    mm_per_px = float(curve.law.depth_per_slope(expected_px)[0])
    error_mm = (slope_px - tilt_px - expected_px[0])[board.inside] * mm_per_px
    known_mm = error_mm[np.isfinite(error_mm)]
    if not known_mm.size:
        return BoardError(0.0, np.nan, np.nan, np.nan)
    return BoardError(
        density_pct=100.0 * known_mm.size / error_mm.size,
        mean_mm=float(known_mm.mean()),
        median_mm=float(np.median(known_mm)),
        spread_mm=float(known_mm.std()),
    )
