"""Light that differs between the cameras over the picture: vignettes, shading, a lamp that moves.

After one gain and one offset for every view, what is left between pixels that show the same point
varies smoothly. It is fitted as a gain and an offset that vary over the picture (a flat-field
correction relative to the reference; D. B. Goldman, "Vignette and exposure calibration and
compensation", IEEE TPAMI 32(12), 2010, has the same for overlapping pictures).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.smooth_field import (
    DOUBT,
    HELD,
    TERMS,
    basis,
    coarse_rms,
    is_sure,
    normal_equations,
    robust_gain,
    values_everywhere,
)

_ROUNDS = 4
_GAIN_SHARE, _OFFSET_SHARE = 0.15, 0.1
"""Expected size of the fields of gain and offset, as shares of the mean grey value, 1 sigma."""
_AT_A_GLANCE = 0.8
_NOTICEABLE, _NOTICEABLE_SHARE = 0.5, 0.006
"""Field over the scatter of single pixels, and over the mean grey value, below which light counts
as the same: gloss alone makes that much."""


@dataclass(frozen=True, slots=True)
class LightField:
    """What brings a view to the light of the reference, but for one gain and one offset."""

    gain: Float
    """(TERMS,) of the field that grey values are multiplied by, less 1."""
    offset: Float
    """(TERMS,) of the field that is added to them, grey levels."""
    rms_levels: float
    """Size of the whole correction over the pixels that it was fitted to."""

    def of(self, grey: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a picture (H, W), of any size, in the light of the reference."""
        times = values_everywhere(self.gain, grey.shape)
        times += np.float32(1)
        times *= grey
        times += values_everywhere(self.offset, grey.shape)
        return times


def fit_light(
    x_px: Float,
    y_px: Float,
    grey: Float,
    target: Float,
    shape: tuple[int, int],
    gain: float,
    offset_levels: float,
) -> LightField | None:
    """Fit what is left of the light between a view and the reference.

    Args:
        x_px: columns in the view, (N,).
        y_px: rows in the view, (N,).
        grey: (N,) values of the view.
        target: (N,) values of the reference.
        shape: height and width of the pictures, px.
        gain: target = gain * grey + offset, as fitted to all of them.
        offset_levels: see there.

    Returns:
        None where the light is the same, or the other half of the pixels does not confirm it.
    """
    if len(grey) <= 2 * TERMS:
        return None
    level = max(float(np.mean(np.abs(target))), 1e-6)
    grey = gain * grey + offset_levels
    usual = 1.4826 * float(np.median(np.abs(target - grey)))
    least = max(_NOTICEABLE * usual, _NOTICEABLE_SHARE * level)
    if coarse_rms(x_px, y_px, target - grey, shape) < _AT_A_GLANCE * least:
        return None
    places = basis(x_px, y_px, shape)
    design = np.hstack([places * (grey / level)[:, None], places])
    expected = np.concatenate([_GAIN_SHARE * level * HELD, _OFFSET_SHARE * level * HELD])
    prior = np.diag(1.0 / expected**2)
    left = target - grey
    is_even = np.arange(len(left)) % 2 == 0
    gains: list[Float] = []
    for own in (is_even, ~is_even):
        found, scatter = _fit(design[own], left[own], prior)
        before, after = left[~own], left[~own] - design[~own] @ found
        doubt = DOUBT * scatter
        gains.append(robust_gain(before, after, doubt))
    if not is_sure(np.concatenate(gains)):
        return None
    found, scatter = _fit(design, left, prior)
    rms_levels = float(np.sqrt(np.mean((design @ found) ** 2)))
    if rms_levels < max(_NOTICEABLE * scatter, _NOTICEABLE_SHARE * level):
        return None
    times, added = found[:TERMS] / level, found[TERMS:]
    # Of grey values before gain and offset.
    return LightField(times, (added + offset_levels * times) / gain, rms_levels)


def _fit(design: Float, left: Float, prior: Float) -> tuple[Float, float]:
    """Robust ridge regression: coefficients, and the scatter that they leave."""
    found, scatter = np.zeros(design.shape[1]), 1.0
    for _ in range(_ROUNDS):
        rest = left - design @ found
        scatter = max(1.4826 * float(np.median(np.abs(rest))), 1e-6)
        weight = 1.0 / (1.0 + (rest / (DOUBT * scatter)) ** 2) / scatter**2
        normal, right = normal_equations(design, weight, left)
        found = np.linalg.solve(normal + prior, right)
    return np.asarray(found, np.float64), scatter
