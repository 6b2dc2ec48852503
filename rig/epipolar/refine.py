"""From slopes of a search to slopes of lines: one step of every line, and neighbours joined."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands, run_side_by_side
from rig.epipolar.behind import behind_jumps
from rig.epipolar.chessboard import filled, thinned
from rig.epipolar.line import LineFits, fit_lines
from rig.epipolar.noise.local import line_precision, locking, reply_share
from rig.epipolar.rank import middle_of
from rig.epipolar.scales import Scales
from rig.epipolar.search.window import LABEL_SHIFT_PX, Cameras
from rig.epipolar.stitch import stitch

Stitched = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Slope and its variance, which counts how far neighbours scatter beyond theirs; both (H, W)."""

_RADIUS_PX, STRIDE_PX = 6, 2


@dataclass(frozen=True, slots=True)
class Start:
    """What slopes are like that come straight from a search."""

    error_px: float
    """As a shift in the outermost view, 1 sigma."""
    mended: float
    """How much of it the line fit mends: the power of the reply by which steps are made longer. At
    1 nothing is left, and the noise of the lines grows most."""


NEAR = Start(0.25 * LABEL_SHIFT_PX, mended=0.5)
FAR = Start(0.5 * LABEL_SHIFT_PX, mended=1.0)
"""At full size and at half size."""


def refine(
    images: NDArray[np.float32],
    splines: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    covered: NDArray[np.bool_],
    cameras: Cameras,
    scales: Scales,
    drift: NDArray[np.float32] | None,
    found: Start | None = None,
    *,
    is_thin: bool = False,
) -> tuple[LineFits, Stitched]:
    """Move every pixel's line one step towards its optimum, and join the optima of neighbours.

    A step falls short of the optimum, which does no harm where the start is as good as the line.
    The error of a search follows the fraction of a pixel and the nearer surfaces around: where the
    start comes from one, steps are made longer.

    Args:
        images: (V, H, W) equalised grey values.
        splines: what `rig.epipolar.sampling.pad` makes of them.
        slope_px: (H, W) start, px per view step.
        covered: (V, H, W) whether a view shows a nearer surface in the place of the point.
        cameras: where the views stand.
        scales: grey scales of the images.
        drift: (2, H, W) light that changes with the view; None for none.
        found: the search that the start comes from; None if it comes from lines already.
        is_thin: whether the lines of every second pixel will do; their maps, and `covered`, are
            thin ones then.
    """
    if found is not None:
        scales = replace(scales, start_error_px=found.error_px)
    lines = fit_lines(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, slope_px, covered,
        scales.doubt, scales.derivative_variance, locking(scales), cameras.step_px, splines,
        drift, is_thin=is_thin,
    )  # fmt: skip
    if found is not None:
        longer = np.float32(1.0 / reply_share(lines, scales) ** found.mended)
        lines = replace(lines, slope_px=slope_px + longer * (lines.slope_px - slope_px))
    return lines, _stitch(slope_px, lines, images[cameras.reference], cameras, scales)


def _stitch(
    slope_px: NDArray[np.float32],
    lines: LineFits,
    grey: NDArray[np.float32],
    cameras: Cameras,
    scales: Scales,
) -> Stitched:
    """Join neighbours whose slopes differ by no more than the lines themselves are uncertain."""
    information = line_precision(lines, scales)
    line_sigma_px = 1.0 / max(middle_of(information[::4, ::4]), 1e-12) ** 0.5
    step_px = cameras.step_px
    slope_gate_px = max(1.5 * step_px, min(7.5 * line_sigma_px, 6.0 * step_px))
    start_px, own = slope_px, grey
    if lines.is_thin:
        start_px, own = run_side_by_side(lambda: thinned(slope_px), lambda: thinned(grey))
    joined, variance, misfit = stitch(
        start_px,
        lines.slope_px,
        behind_jumps(slope_px, information, 2.0 * step_px),
        own,
        radius_px=_RADIUS_PX,
        stride_px=STRIDE_PX,
        slope_gate_px=slope_gate_px,
        grey_gate=scales.likeness,
        is_thin=lines.is_thin,
    )

    def widen(start: int, stop: int) -> None:
        variance[start:stop] *= np.maximum(misfit[start:stop], np.float32(1))

    run_in_bands(widen, len(variance))
    if not lines.is_thin:
        return joined, variance
    return filled(
        joined, variance, start_px, own, slope_px, grey,
        slope_gate_px=slope_gate_px,
        grey_gate=scales.likeness,
    )  # fmt: skip
