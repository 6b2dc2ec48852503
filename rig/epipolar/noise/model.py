"""How the noise of a pixel grows with its grey value, and grey values without that growth.

Shot noise makes the variance of a grey value grow in proportion to the light: the photon transfer
line (J. R. Janesick, "Photon Transfer", SPIE 2007). It is measured from repeated pictures (`rig
check`) or told by the images of one instant. The transformation that makes the noise of such values
the same everywhere is the generalised Anscombe transformation (F. Murtagh, J.-L. Starck and A.
Bijaoui, "Image restoration with noise suppression using a multiresolution support", Astron.
Astrophys. Suppl. 112, 1995): in the stabilised images every scale of the estimator that follows the
noise follows the noise of the pixel's own grey value.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.epipolar.noise.white import QUIET_SHARE, Blocks, blocks_of_all
from rig.epipolar.rank import quantile
from rig.errors import SlopeError

_GREY_BINS, _FEWEST_BINS, _FEWEST_BLOCKS = 8, 3, 10
_EVEN = 0.3
"""Spread over mean of a block's grey values, noise taken off, up to which it has one brightness."""
_ABOVE_WEIGHT, _ROUNDS = 0.1, 20
_NOTICEABLE_RATIO = 1.2
"""Noise of bright over that of dark pixels up to which it counts as white: what the texture of
scenes with white noise makes of it stays below 1.1."""


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Variance of a grey value: read noise^2 + rounding step^2 / 12 + grey / electrons per level.

    All in levels of the images that it is of, at the gain that they were taken with.
    """

    read_noise_levels: float
    """Noise at grey level 0 without rounding, 1 sigma."""
    electrons_per_level: float = float("inf")
    """Conversion gain; infinite where noise does not grow with light."""
    step_levels: float = 1.0
    """What grey values were rounded to multiples of; 0 for values that never were."""

    def __post_init__(self) -> None:
        if not (
            0.0 <= self.read_noise_levels < np.inf
            and self.electrons_per_level > 0.0
            and 0.0 <= self.step_levels < np.inf
        ):
            raise SlopeError(
                f"noise given as {self.read_noise_levels} levels of read noise, "
                f"{self.electrons_per_level} electrons per level and {self.step_levels} levels of "
                "rounding",
                advice="give a finite 1 sigma of 0 or more, a gain above 0 and a step of 0 or "
                "more, as rig check measures them",
            )

    def sigma_levels(self, grey_levels: float) -> float:
        """Noise of a pixel of a grey value, 1 sigma, rounding included."""
        return float(np.sqrt(self._floor + max(grey_levels, 0.0) / self.electrons_per_level))

    def stabilised(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Grey values (V, H, W) on a scale where the noise of each is 1 sigma = 1.

        Below grey level 0 the scale goes on in a straight line.
        """
        rise = np.float32(1.0 / self.electrons_per_level)
        # A pixel without electrons has no noise, but one level above it has: never divide by 0.
        floor = np.float32(max(self._floor, 1e-3 * rise * float(images.max()), 1e-12))
        stable = np.empty_like(images)

        def work(start: int, stop: int) -> None:
            for i in range(start, stop):
                grey, out = images[i], stable[i]
                # 2 / rise (sqrt(floor + rise grey) - sqrt(floor)), also where the rise is 0
                np.maximum(grey, np.float32(0), out=out)
                out *= rise
                out += floor
                np.sqrt(out, out=out)
                out += np.sqrt(floor)
                np.divide(np.float32(2) * grey, out, out=out)

        run_in_bands(work, len(images))
        return stable

    def raised(self, ratio: float) -> "NoiseModel":
        """Return the model of a noise that is larger by a ratio at every grey value."""
        if ratio == 1.0:
            return self
        floor = ratio**2 * self._floor - self.step_levels**2 / 12.0
        electrons = self.electrons_per_level / ratio**2
        return NoiseModel(max(floor, 0.0) ** 0.5, electrons, self.step_levels)

    def is_white(self, dark_levels: float, bright_levels: float) -> bool:
        """Whether pixels of two grey values have nearly the same noise."""
        ratio = self.sigma_levels(bright_levels) / max(self.sigma_levels(dark_levels), 1e-12)
        return ratio <= _NOTICEABLE_RATIO

    @property
    def _floor(self) -> float:
        return self.read_noise_levels**2 + self.step_levels**2 / 12.0


_LEAST_RATIO = 1.25


@dataclass(frozen=True, slots=True)
class CrossNoise:
    """How views differ beyond what a single picture tells of its noise."""

    ratio: float = 1.0
    """Noise between the views over that of one picture."""
    misfit_px: float = 0.0
    """By how much lines miss each other in the outermost view, 1 sigma."""
    likeness: Float | None = None
    """(7, 7) correlation of what is left at pixels and at those around; None for white noise."""

    @property
    def excess(self) -> float:
        """The ratio where it says more than chance; 1 where the picture told its own noise."""
        return self.ratio if self.ratio > _LEAST_RATIO else 1.0


def estimate_noise(images: Sequence[NDArray[np.float32]], step_levels: float) -> NoiseModel:
    """Tell the noise of images (H, W) of one grey scale from themselves.

    The quietest blocks of each of some grey values have at least its noise, and more where even
    they show texture: the line is the lower envelope of what they have (C. Liu, W. T. Freeman, R.
    Szeliski and S. B. Kang, "Noise estimation from a single image", CVPR 2006).

    Args:
        images: one or more.
        step_levels: what grey values were rounded to multiples of, 0 for none.
    """
    found = blocks_of_all(images)
    rounding = step_levels**2 / 12.0
    white = float(np.median([blocks.quiet_noise for blocks in found]))
    flat = NoiseModel(max(white**2 - rounding, 0.0) ** 0.5, step_levels=step_levels)
    grey, noise = _quiet_by_grey(found)
    if len(grey) < _FEWEST_BINS:
        return flat
    floor, rise = _lower_envelope(grey, noise**2, rounding)
    if rise <= 0:
        return flat
    shot = NoiseModel(max(floor - rounding, 0.0) ** 0.5, 1.0 / rise, step_levels)
    return flat if shot.is_white(grey[0], grey[-1]) else shot


def _quiet_by_grey(found: Sequence[Blocks]) -> tuple[Float, Float]:
    """Grey value and noise of the quietest blocks of even brightness, dark ones first."""
    grey, spread, noise = (
        np.concatenate([getattr(blocks, name) for blocks in found])
        for name in ("grey", "spread", "noise")
    )
    even = spread**2 - noise**2 <= (_EVEN * np.maximum(grey, 0)) ** 2
    blocks = Blocks(grey[even], spread[even], noise[even])
    bins = min(_GREY_BINS, len(blocks.grey) // _FEWEST_BLOCKS)
    order = np.argsort(blocks.grey, kind="stable")
    parts = np.array_split(order, bins) if bins else []
    quietest = [_quietest(Blocks(blocks.grey[p], blocks.spread[p], blocks.noise[p])) for p in parts]
    return np.array([grey for grey, _ in quietest]), np.array([noise for _, noise in quietest])


def _quietest(blocks: Blocks) -> tuple[float, float]:
    """Grey value and noise of the quietest blocks of about one grey value."""
    quiet = blocks.noise <= quantile(blocks.noise, QUIET_SHARE)
    return float(blocks.grey[quiet].mean()), blocks.quiet_noise


def _lower_envelope(grey: Float, variance: Float, least: float) -> tuple[float, float]:
    """Start (`least` or more) and rise (0 or more) of the line that few points lie below.

    An expectile regression (W. K. Newey and J. L. Powell, "Asymmetric least squares estimation and
    testing", Econometrica 55, 1987) of relative residuals.
    """
    floor, rise = max(float(variance.min()), least), 0.0
    for _ in range(_ROUNDS):
        line = np.maximum(floor + rise * grey, 1e-12)
        weight = np.where(variance > line, _ABOVE_WEIGHT, 1.0) / line**2
        weight /= weight.sum()
        mean, level = float((weight * grey).sum()), float((weight * variance).sum())
        spread = float((weight * (grey - mean) ** 2).sum())
        rise = max(float((weight * (grey - mean) * (variance - level)).sum()) / spread, 0.0)
        floor = level - rise * mean
        if floor < least:
            floor = least
            above = float((weight * grey * (variance - least)).sum())
            rise = max(above / float((weight * grey**2).sum()), 0.0)
    return floor, rise
