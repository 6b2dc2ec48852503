"""The grey scales of one estimate, all derived from measured noise and texture."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.noise.model import NoiseModel, estimate_noise
from rig.epipolar.noise.white import blocks_of_all
from rig.epipolar.rank import quantile
from rig.epipolar.spline import INVERSE

_PREFILTER_FROM_RATIO = 0.1
"""Noise over texture below which smoothing loses more than it gains."""
_SMALLEST_PREFILTER_PX = 0.3
_USUAL_SHARE, _USUAL_FACTOR, _USUAL_BLOCK_PX = 0.75, 2.0, 8
"""Twice the texture that three quarters of the picture stay below: few strong edges make the mean
texture of a picture, and would leave the rest of it unfiltered."""
_NOISE_VIEWS = 3
_ALIKE_SHARE = 0.85
_START_ERROR_PX = 0.035
# Taps of a cubic B-spline a share t behind a pixel, rows of t^0 to t^3; and of its derivative.
_T = (np.arange(16)[:, None] + 0.5) / 16
_CUBIC = np.array([[1.0, 4.0, 1.0, 0.0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6
_VALUES = _CUBIC[0] + _T * _CUBIC[1] + _T**2 * _CUBIC[2] + _T**3 * _CUBIC[3]
_DERIVATIVES = _CUBIC[1] + 2 * _T * _CUBIC[2] + 3 * _T**2 * _CUBIC[3]


@dataclass(frozen=True, slots=True)
class Scales:
    """Grey values are those of the reference view."""

    noise: float
    """White noise, 1 sigma, before the prefilter."""
    texture: float
    """Root mean square difference of neighbouring pixels without its noise part."""
    start_error_px: float = _START_ERROR_PX
    """How far the slopes that a line fit starts from are off, as a shift in the views."""
    misfit_px: float = 0.0
    """By how much lines miss each other in the views, 1 sigma; 0 where it is a trifle."""
    is_alike: bool = False
    """Whether the noise of neighbours is alike, so that smaller pictures keep most of it."""
    usual_texture: float = math.inf
    """What `texture` is at most away from few strong edges."""
    least_prefilter_px: float = 0.0
    """Sigma of the prefilter of clean images."""

    @property
    def prefilter_px(self) -> float:
        """Sigma of the Gaussian prefilter: grows with noise over texture."""
        texture = min(self.texture, self.usual_texture)
        excess = self.noise / max(texture, 1e-6) - _PREFILTER_FROM_RATIO
        sigma_px = min(1.1 * max(excess, 0.0) ** 0.5, 1.5)
        noisy = sigma_px if sigma_px >= _SMALLEST_PREFILTER_PX else 0.0
        return max(noisy, self.least_prefilter_px)

    @property
    def blur_px(self) -> int:
        """How far a grey edge reaches into what is beside it: the pixel, and the prefilter."""
        return 2 + math.ceil(self.prefilter_px - 0.5)

    @property
    def truncation(self) -> float:
        """Difference that counts as a full mismatch in the sweep."""
        return 3.5 * self.noise + max(0.4, 3.5 * self.misfit_px) * self.texture

    @property
    def doubt(self) -> float:
        """Cauchy scale of the line fit."""
        return self.noise + math.hypot(self.start_error_px, self.misfit_px) * self.texture

    @property
    def likeness(self) -> float:
        """Difference up to which two pixels are taken for one surface."""
        return 3.0 * self.noise + 1.0 * self.texture

    @property
    def shrunk_noise(self) -> float:
        """Noise that is left in pictures of half the size if it is alike in neighbours, 1 sigma."""
        return _ALIKE_SHARE * self.noise if self.is_alike else 0.0

    @property
    def smoothed_noise(self) -> float:
        """White noise that is left after the prefilter, 1 sigma."""
        return self.noise * float((self._prefilter() ** 2).sum())

    @property
    def sampled_share(self) -> float:
        """Noise of a sample between pixels over that of a pixel, after the prefilter."""
        along, across = self._spline()
        power = [(np.convolve(along, taps) ** 2).sum() for taps in _VALUES]
        return self.noise * (across * float(np.mean(power))) ** 0.5 / self.smoothed_noise

    @property
    def derivative_variance(self) -> float:
        """Variance of the derivative of the grey value along one axis due to noise, per px^2.

        Of the prefiltered image, between its pixels (B-spline), at a random place.
        """
        along, across = self._spline()
        power = [(np.convolve(along, taps) ** 2).sum() for taps in _DERIVATIVES]
        return self.noise**2 * across * float(np.mean(power))

    @property
    def locking(self) -> tuple[float, float, float]:
        """How noise alone correlates the grey value between pixels with its own derivative.

        A sample between pixels averages more noise away than one on a pixel, so that the variance
        of the samples falls with the distance to the pixels, and lines feel drawn there. The
        covariance is half the derivative of that variance: c1 s + c3 s^3 + c5 s^5, where s is the
        distance to the middle between two pixels; here c1, c3, c5, (grey)^2 / px.
        """
        along, across = self._spline()
        pairs = zip(_VALUES, _DERIVATIVES, strict=True)
        covariance = [np.convolve(along, v) @ np.convolve(along, d) for v, d in pairs]
        s = _T - 0.5
        found = np.linalg.lstsq(np.hstack([s, s**3, s**5]), np.array(covariance), rcond=None)[0]
        c1, c3, c5 = (self.noise**2 * across * found).tolist()
        return c1, c3, c5

    def _spline(self) -> tuple[NDArray[np.float64], float]:
        """Weights of prefilter and spline along one axis; power of the prefilter along the other.

        White noise of variance 1 keeps that much in a sample.
        """
        prefilter = self._prefilter()
        return np.convolve(prefilter, INVERSE), float((prefilter**2).sum())

    def _prefilter(self) -> NDArray[np.float64]:
        """Weights of the prefilter along one axis."""
        if self.prefilter_px == 0:
            return np.ones(1)
        gauss = np.exp(-0.5 * (np.arange(-8, 9) / self.prefilter_px) ** 2)
        return gauss / gauss.sum()


@dataclass(frozen=True, slots=True)
class Grading:
    """How grey values are brought to one noise, and what they are like then."""

    stabiliser: NoiseModel | None
    """Noise that grows with light, which is taken out; None where grey values stay as they are."""
    scales: Scales

    def of(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Bring grey values (V, H, W) to that noise."""
        return images if self.stabiliser is None else self.stabiliser.stabilised(images)


def measure_scales(
    images: NDArray[np.float32], reference: int, least_noise_levels: float = 0.0
) -> Scales:
    """Measure noise (median over some views) and texture (reference view) of images (V, H, W).

    Args:
        images: equalised grey values.
        reference: index of the reference view.
        least_noise_levels: 1 sigma that is known to be there even if the images do not show it.
    """
    noise = float(np.median([blocks.quiet_noise for blocks in blocks_of_all(_some(images))]))
    return _scales_of(images[reference], max(noise, least_noise_levels))


def noise_of(images: NDArray[np.float32], grey_step: float, known: NoiseModel | None) -> NoiseModel:
    """Return the noise that is known, or what single pictures of (V, H, W) tell.

    Args:
        images: equalised grey values.
        grey_step: what grey values were rounded to multiples of; quiet blocks may hide that, they
            are flat where nothing crosses a step.
        known: noise as measured; None to estimate it from the images.
    """
    return known or estimate_noise(_some(images), grey_step)


def stabilise(
    images: NDArray[np.float32], reference: int, model: NoiseModel, *, is_told: bool
) -> tuple[NDArray[np.float32], Grading]:
    """Bring images (V, H, W) to a scale where all pixels have one noise; measure texture.

    Where dark and bright pixels have nearly the same noise, the grey values stay as they are.

    Args:
        images: equalised grey values.
        reference: index of the reference view.
        model: their noise.
        is_told: whether it comes from elsewhere, so that the images may show more.
    """
    sample = images[reference, ::8, ::8].ravel()
    dark, middle, bright = (quantile(sample, share) for share in (0.05, 0.5, 0.95))
    if model.is_white(dark, bright):
        stabiliser, least = None, model.sigma_levels(middle)
    else:
        stabiliser, least = model, 1.0
        images = model.stabilised(images)
    if is_told:
        return images, Grading(stabiliser, measure_scales(images, reference, least))
    return images, Grading(stabiliser, _scales_of(images[reference], least))


def _some(images: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    return list(images[:: -(-len(images) // _NOISE_VIEWS)])


def _scales_of(grey: NDArray[np.float32], noise: float) -> Scales:
    """Scales of a reference view (H, W) with white noise of a known size."""
    power = 0.5 * (_mean_square(grey[1:], grey[:-1]) + _mean_square(grey[:, 1:], grey[:, :-1]))
    texture = max(power - 2.0 * noise**2, 0.0) ** 0.5
    floor = 1e-4 * float(np.ptp(grey)) + 1e-9
    usual = _usual_texture(grey, noise)
    return Scales(max(noise, floor), max(texture, floor), usual_texture=max(usual, floor))


def _usual_texture(grey: NDArray[np.float32], noise: float) -> float:
    """`Scales.usual_texture` of a reference view (H, W)."""
    along, down = np.diff(grey, axis=1)[:-1], np.diff(grey, axis=0)[:, :-1]
    power = np.float32(0.5) * (along * along + down * down)
    height, width = (max(side // _USUAL_BLOCK_PX, 1) for side in power.shape)
    blocks = np.asarray(
        cv2.resize(power, (width, height), interpolation=cv2.INTER_AREA), np.float32
    )
    usual = quantile(blocks.ravel(), _USUAL_SHARE) - 2.0 * noise**2
    return _USUAL_FACTOR * max(usual, 0.0) ** 0.5


def _mean_square(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Mean squared difference of two maps."""
    return float(cv2.norm(one, other, cv2.NORM_L2SQR)) / one.size
