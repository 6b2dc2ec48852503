"""How far pictures of fine pixels are softened, so that all views show as much detail."""

from collections.abc import Sequence

import numpy as np

_AS_FINE = 1.25
"""Ratio of pixel sizes that lenses alone may make; nothing is softened for that."""
_BLUR_PX = 0.8
"""Blur of a picture in its own pixels, 1 sigma: lenses are made for the pixels behind them."""

_REACH = 40
"""Pixels beyond which no Gaussian that is used here has weight."""


def softening_px(finer: Sequence[float]) -> tuple[float, ...]:
    """Return the Gaussian, 1 sigma in raw px, that each view needs to be as soft as the coarsest.

    Detail that one view shows and another does not, or that comes back as another pattern where
    pixels become larger, looks like noise that no slope explains.

    Args:
        finer: per view how many of its raw pixels lie along one rectified pixel.
    """
    coarsest = min(1.0, *finer)
    return tuple(
        _BLUR_PX * float(np.sqrt((one / coarsest) ** 2 - 1.0)) if one > _AS_FINE * coarsest else 0.0
        for one in finer
    )


def noise_left(soft_px: Sequence[float]) -> float:
    """Share of the noise, as variance, that softening leaves in a picture: the mean of all views.

    Args:
        soft_px: 1 sigma of the Gaussian of each view.
    """
    return float(np.mean([_power(soft) for soft in soft_px]))


def _power(soft_px: float) -> float:
    """Sum of the squared weights of a Gaussian along both axes."""
    if soft_px == 0.0:
        return 1.0
    taps = np.exp(-0.5 * (np.arange(-_REACH, _REACH + 1) / soft_px) ** 2)
    return float(((taps / taps.sum()) ** 2).sum() ** 2)
