"""Noise of a camera by photon transfer: variance against mean of a static scene.

Shot noise makes the variance of a grey value grow in proportion to the light; the slope of that
line is the conversion gain and its start the noise that is there without light (J. R. Janesick,
"Photon Transfer", SPIE 2007; EMVA Standard 1288 release 4, section 6). Any static scene with bright
and dark parts will do.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

_BINS = 24
_FEWEST_PIXELS = 200
"""Of one bin."""
_FLAT_SHARE = 0.8
"""Share of the pixels, those with the least gradient, that vibration cannot make noisy."""
_QUANTISATION = 1.0 / 12.0
"""Variance that rounding to whole levels adds."""


@dataclass(frozen=True, slots=True)
class PhotonTransfer:
    """The line variance = floor + mean / electrons_per_level, in grey levels of the image."""

    electrons_per_level: float
    """Conversion gain; infinite or negative where the noise does not grow with light."""
    read_noise_levels: float
    """Noise at grey level 0, rounding taken off. A camera that gives black as level b reads a
    little less than its true read noise: its square lacks b / electrons_per_level."""
    straightness: float
    """Share of the spread of the variances that the line explains, 0..1."""

    def sigma_levels(self, mean_levels: float) -> float:
        """Return the noise of a pixel with a mean grey value, rounding included."""
        variance = (
            self.read_noise_levels**2 + _QUANTISATION + mean_levels / self.electrons_per_level
        )
        return float(np.sqrt(max(0.0, variance)))


def photon_transfer(images: NDArray[np.generic], full_scale_levels: float) -> PhotonTransfer | None:
    """Fit the photon transfer line to repeated pictures of one view.

    Variances come from differences of successive pictures, each brought to the same brightness, so
    that lamps which drift or flicker as a whole do not count.

    Args:
        images: (K, H, W) grey pictures of a static scene, K at least 3.
        full_scale_levels: grey level of a saturated pixel.

    Returns:
        None where the scene has too little light and shade for a line.
    """
    mean, variance, steady = _moments(images, full_scale_levels)
    flat = steady & _flat(mean)
    levels, variances, pixels = _binned(mean[flat], variance[flat])
    if len(levels) < 3 or levels[-1] < 2.0 * levels[0]:
        return None
    model = variances
    floor = rise = 0.0
    for _ in range(3):  # the variance of a variance goes with its square, over the pixels
        weight = pixels / np.maximum(model, _QUANTISATION) ** 2
        floor, rise = _line(levels, variances, weight)
        model = floor + rise * levels
    return PhotonTransfer(
        electrons_per_level=1.0 / rise if rise != 0.0 else float("inf"),
        read_noise_levels=float(np.sqrt(max(0.0, floor - _QUANTISATION))),
        straightness=_explained(variances, model, pixels),
    )


def _moments(
    images: NDArray[np.generic], full_scale: float
) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Mean and variance of every pixel, and which pixels stay clear of both ends of the scale."""
    brightness = np.array([float(np.mean(image, dtype=np.float64)) for image in images])
    factors = brightness.mean() / np.maximum(brightness, 1e-9)
    total = np.zeros(images.shape[1:])
    squared = np.zeros(images.shape[1:])
    before: Float | None = None
    for image, factor in zip(images, factors, strict=True):
        now = image.astype(np.float64) * factor
        total += now
        if before is not None:
            squared += (now - before) ** 2
        before = now
    steady = (images.max(axis=0) < full_scale) & (images.min(axis=0) > 0)
    return total / len(images), squared / (2.0 * (len(images) - 1)), steady


def _flat(mean: Float) -> NDArray[np.bool_]:
    down, right = np.gradient(mean)
    gradient = np.hypot(down, right)
    return gradient <= np.quantile(gradient, _FLAT_SHARE)


def _binned(mean: Float, variance: Float) -> tuple[Float, Float, Float]:
    """Average mean and variance by grey level; bins with few pixels are left out."""
    if mean.size < _FEWEST_PIXELS:
        return np.empty(0), np.empty(0), np.empty(0)
    edges = np.linspace(mean.min(), mean.max(), _BINS + 1)
    place = np.clip(np.digitize(mean, edges) - 1, 0, _BINS - 1)
    pixels = np.bincount(place, minlength=_BINS).astype(np.float64)
    enough = pixels >= _FEWEST_PIXELS
    levels = np.bincount(place, mean, _BINS)[enough] / pixels[enough]
    variances = np.bincount(place, variance, _BINS)[enough] / pixels[enough]
    return levels, variances, pixels[enough]


def _line(x: Float, y: Float, weight: Float) -> tuple[float, float]:
    total = weight.sum()
    middle_x, middle_y = (weight * x).sum() / total, (weight * y).sum() / total
    rise = (weight * (x - middle_x) * (y - middle_y)).sum() / (weight * (x - middle_x) ** 2).sum()
    return float(middle_y - rise * middle_x), float(rise)


def _explained(variances: Float, model: Float, pixels: Float) -> float:
    spread = (pixels * (variances - np.average(variances, weights=pixels)) ** 2).sum()
    left = (pixels * (variances - model) ** 2).sum()
    return float(np.clip(1.0 - left / spread, 0.0, 1.0)) if spread > 0.0 else 0.0
