"""The grey scales of one estimate, all derived from measured noise and texture."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.noise import noise_grey

_PREFILTER_FROM_RATIO = 0.1
"""Noise over texture below which smoothing loses more than it gains."""
_SMALLEST_PREFILTER_PX = 0.3
_NOISE_VIEWS = 3


@dataclass(frozen=True, slots=True)
class Scales:
    """Grey values are those of the reference view."""

    noise: float
    """White noise, 1 sigma, before the prefilter."""
    texture: float
    """Root mean square difference of neighbouring pixels without its noise part."""

    @property
    def prefilter_px(self) -> float:
        """Sigma of the Gaussian prefilter: grows with noise over texture, 0 for clean images."""
        excess = self.noise / max(self.texture, 1e-6) - _PREFILTER_FROM_RATIO
        sigma_px = min(1.1 * max(excess, 0.0) ** 0.5, 1.5)
        return sigma_px if sigma_px >= _SMALLEST_PREFILTER_PX else 0.0

    @property
    def truncation(self) -> float:
        """Difference that counts as a full mismatch in the sweep."""
        return 3.5 * self.noise + 0.4 * self.texture

    @property
    def doubt(self) -> float:
        """Cauchy scale of the line fit."""
        return self.noise + 0.035 * self.texture

    @property
    def likeness(self) -> float:
        """Difference up to which two pixels are taken for one surface."""
        return 3.0 * self.noise + 1.0 * self.texture

    @property
    def smoothed_noise(self) -> float:
        """White noise that is left after the prefilter, 1 sigma."""
        if self.prefilter_px == 0:
            return self.noise
        taps = np.arange(-8, 9)
        gauss = np.exp(-0.5 * (taps / self.prefilter_px) ** 2)
        gauss /= gauss.sum()
        return self.noise * float((gauss**2).sum())


def measure_scales(images: NDArray[np.float32], reference: int) -> Scales:
    """Measure noise (median over some views) and texture (reference view) of images (V, H, W)."""
    sampled = images[:: max(1, len(images) // _NOISE_VIEWS)]
    noise = float(np.median([noise_grey(image) for image in sampled]))
    grey = images[reference]
    power = 0.5 * (_mean_square(grey[1:], grey[:-1]) + _mean_square(grey[:, 1:], grey[:, :-1]))
    texture = max(power - 2.0 * noise**2, 0.0) ** 0.5
    floor = 1e-4 * float(np.ptp(grey)) + 1e-9
    return Scales(max(noise, floor), max(texture, floor))


def _mean_square(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Mean squared difference of two maps."""
    return float(cv2.norm(one, other, cv2.NORM_L2SQR)) / one.size
