"""What a frame measures because its turn has come, and what it takes over from the one before."""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.drift import coarse_drift
from rig.epipolar.noise.local import pooled_share
from rig.epipolar.noise.model import CrossNoise
from rig.epipolar.prepare import Ready
from rig.epipolar.refine import STRIDE_PX
from rig.epipolar.search.window import Window
from rig.epipolar.steady import Steady, Turn


def broad_drift(ready: Ready, window: Window) -> NDArray[np.float32] | None:
    """Light that changes with the view, before slopes are known."""
    if ready.before is not None and not ready.is_due(Turn.DRIFT):
        return ready.before.drift
    return coarse_drift(ready.images, ready.cameras, window, ready.first)


def known_rivals(ready: Ready) -> NDArray[np.float32] | None:
    """Second slopes of the last multi-view where unknown pixels keep them; None to search."""
    if ready.before is None or ready.is_due(Turn.UNKNOWN):
        return None
    return ready.before.rival_px


def pooled_in_turn(ready: Ready, cross: CrossNoise) -> float:
    """How much less than independent ones the lines of neighbours tell."""
    if ready.before is not None and not ready.is_due(Turn.NOISE):
        return ready.before.pooled_share
    grey = ready.images[ready.cameras.reference]
    return pooled_share(grey, ready.scales, STRIDE_PX, cross.likeness)


def handed_on(
    ready: Ready,
    share: float,
    drift: NDArray[np.float32] | None,
    rival_px: NDArray[np.float32],
    slope_px: NDArray[np.float32],
) -> Steady | None:
    """What the next multi-view need not measure; None where the views have no common gains.

    Args:
        ready: the views.
        share: what `pooled_in_turn` says.
        drift: what `broad_drift` says.
        rival_px: (H, W) second slopes that explain the views as well, NaN for none.
        slope_px: (H, W) slopes, also where they are no answer.
    """
    if ready.gains is None:
        return None
    before, wide_share = ready.before, ready.wide_share
    if before is not None and not ready.is_due(Turn.UNKNOWN):
        wide_share = before.wide_share
    return Steady(
        ready.cameras.x_steps,
        ready.cameras.y_steps,
        ready.gains,
        ready.grading,
        share,
        drift,
        rival_px,
        slope_px,
        wide_share,
        settled_share=_settled_share(ready),
        turn=Turn.GAINS if before is None else before.next_turn(),
    )


def _settled_share(ready: Ready) -> float | None:
    """See `Steady.settled_share`."""
    if ready.before is None:
        return None
    settled_share = ready.before.settled_share
    return ready.wide_share if settled_share is None else settled_share
