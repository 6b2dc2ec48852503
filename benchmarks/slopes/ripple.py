"""Bias that follows the fraction of the slope: a plane whose texture is known in closed form.

The texture is a sum of waves. Each is integrated over the pixel's square and moved by the slope
exactly (a wave times two sinc functions, and a phase), so that the renderer has no share in what is
found.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews

Array = NDArray[np.float64]
Estimate = Callable[[RectifiedViews, tuple[float, float]], NDArray[np.floating]]

_SHAPE, _BORDER_PX = (400, 640), 40
_RANGE_PX = (-20.0, 60.0)
_SLOPES_PX = 12.0 + np.arange(20) / 20
_WAVES, _CONTRAST, _MEAN = 80, 28.0, 125.0
_LONGEST_PX, _SHORTEST_PX = 40.0, 3.5
_STEPS = np.array([0.0, -1.0, 1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, -1.0, 1.0])
"""Whole steps: all views show the same fraction of a pixel, so that nothing averages out."""


@dataclass(frozen=True)
class Ripple:
    """Mean errors over the plane, px per view step."""

    bias_px: float
    """Mean over all slopes."""
    largest_px: float
    """Largest deviation of one slope's mean from it."""
    doubt_px: float
    """What chance adds to the mean of one slope, 1 sigma: from means of parts of the plane."""


def measure_ripple(estimate: Estimate, noise: float) -> Ripple:
    """Move a square-on plane through one px of slope in twentieths.

    Args:
        estimate: slopes (H, W) from views and a range.
        noise: grey levels, 1 sigma; 0 gives frames that are not rounded either.
    """
    means: list[float] = []
    doubts: list[float] = []
    for k, slope_px in enumerate(_SLOPES_PX):
        frames = _render(float(slope_px))
        if noise > 0:
            noisy = frames + noise * np.random.default_rng(k).standard_normal(frames.shape)
            frames = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
        else:
            frames = frames.astype(np.float32)
        error = estimate(RectifiedViews(frames, *_STEPS, 0), _RANGE_PX) - slope_px
        inner = error[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
        parts = [part.mean() for band in np.array_split(inner, 8) for part in _columns(band)]
        means.append(float(np.mean(parts)))
        doubts.append(float(np.std(parts) / np.sqrt(len(parts))))
    bias = float(np.mean(means))
    return Ripple(bias, float(np.abs(np.array(means) - bias).max()), float(np.mean(doubts)))


def _columns(band: NDArray[np.floating]) -> list[NDArray[np.floating]]:
    return np.array_split(band, 14, axis=1)


def _render(slope_px: float) -> Array:
    """All views of the plane (V, H, W), grey levels, each pixel the mean over its square."""
    rng = np.random.default_rng(3)
    length = np.exp(rng.uniform(np.log(_SHORTEST_PX), np.log(_LONGEST_PX), _WAVES))
    angle, phase = rng.uniform(0, 2 * np.pi, (2, _WAVES))
    per_column, per_row = np.cos(angle) / length, np.sin(angle) / length
    weight = length**0.5
    weight *= np.sinc(per_column) * np.sinc(per_row) * _CONTRAST / np.sqrt(0.5 * (weight**2).sum())
    views: list[Array] = []
    for x, y in zip(*_STEPS, strict=True):
        columns = np.arange(_SHAPE[1])[:, None] + slope_px * x
        rows = np.arange(_SHAPE[0])[:, None] + slope_px * y
        along = np.exp(2j * np.pi * per_column * columns + 1j * phase)
        down = weight * np.exp(2j * np.pi * per_row * rows)
        views.append(_MEAN + (down @ along.T).real)
    return np.stack(views)
