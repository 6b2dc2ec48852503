"""A plane at slopes between the labels: error around it, and bias that follows the fraction."""

from dataclasses import dataclass

import numpy as np

from benchmarks.slopes.scenes import SPARSE
from rig.epipolar import RectifiedViews, estimate_slopes
from tests.support.lightfield import (
    Surface,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

_SHAPE, _BORDER_PX = (128, 160), 40
_SLOPES_PX = np.arange(12.0, 13.0, 0.125)
_FOCAL_PX, _TILT_DEG = 800.0, 5.7


@dataclass(frozen=True)
class PlaneErrors:
    """Of a plane that moves through one px of slope, px per view step."""

    subpixel_rms_px: float
    """Root mean square distance from a plane fitted to the slopes (as RealSense measures it)."""
    bias_px: float
    """Mean error."""
    ripple_px: float
    """Largest deviation of one place's mean error from the mean over all places."""


def measure_plane(*, is_tilted: bool) -> PlaneErrors:
    """Errors on a plane square-on to the array, or tilted by 5.7 degrees, noise 2."""
    scatter: list[float] = []
    bias: list[float] = []
    for k, slope_px in enumerate(_SLOPES_PX):
        # Z grows by tan(tilt) per unit of X: dm/du = -m tan(tilt) / f.
        per_u = -slope_px * np.tan(np.deg2rad(_TILT_DEG)) / _FOCAL_PX if is_tilted else 0.0
        texture = noise_texture(50 + k, mean=125, contrast=28, finest_px=1.8)
        wall = [Surface(plane(slope_px - 0.5 * _SHAPE[1] * per_u, per_u), texture, everywhere)]
        exact = render_views(wall, _SHAPE, SPARSE.x_steps, SPARSE.y_steps, supersample=2)
        frames = expose(exact, noise=2.0, gain_spread=0.02, seed=k)
        views = RectifiedViews(frames, SPARSE.x_steps, SPARSE.y_steps, 0)
        found = estimate_slopes(views, (-20.0, 60.0)).slope_px
        inner = (slice(_BORDER_PX, -_BORDER_PX),) * 2
        rows, columns = (grid[inner].ravel() for grid in np.mgrid[: _SHAPE[0], : _SHAPE[1]])
        design = np.stack([np.ones_like(rows), rows, columns], axis=1).astype(float)
        slopes = found[inner].ravel().astype(float)
        fitted = design @ np.linalg.lstsq(design, slopes, rcond=None)[0]
        scatter.append(float(((slopes - fitted) ** 2).mean()))
        bias.append(float((slopes - true_slope_px(wall, _SHAPE)[inner].ravel()).mean()))
    return PlaneErrors(
        float(np.sqrt(np.mean(scatter))),
        float(np.mean(bias)),
        float(np.abs(np.array(bias) - np.mean(bias)).max()),
    )
