"""Makes the pictures of one instant fit each other: rows that meet, light that is the same."""

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.colour import luminance, merge_channels
from rig.epipolar.mending.first_match import FirstMatch, first_match
from rig.epipolar.mending.gains import Gains
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.photometry import Light, equalise
from rig.epipolar.mending.row_drift import RowDrift
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.mending.rows import find_row_errors
from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.search.shrink import grow
from rig.epipolar.search.window import Cameras, Window
from rig.epipolar.views import Image, RectifiedViews


@dataclass(frozen=True, slots=True)
class Fitted:
    """Grey values that can be compared."""

    images: NDArray[np.float32]
    """(V, H, W) of the reference's rows and light."""
    agreement: NDArray[np.float64]
    """(V,) of each view with the reference, as `Equalised` has it."""
    mending: Mending
    """What it took."""
    gains: Gains | None
    """Of every view; None in colour, where each channel has its own."""
    first: FirstMatch
    """What paired the pixels, from the pictures before their light was the same."""

    @property
    def rough_slope_px(self) -> NDArray[np.float32]:
        """(H, W) slopes of the first match, px per view step."""
        factor, (height, width) = self.first.factor, self.images.shape[1:]
        return np.float32(factor) * grow(self.first.slope_px, factor, (height, width))


def fit_together(
    views: RectifiedViews,
    window: Window,
    grey_step: float,
    noise: NoiseModel | None,
    gains: Gains | None = None,
) -> Fitted:
    """Take out what is wrong with the pictures, as known or as they show it themselves.

    What is known from the last multi-view is taken as it is. Rows that are expected to miss are
    brought together first, and what is left is looked for. Where nothing is known, and a hypothesis
    stands for the match, only gain and offset are looked for.

    Args:
        views: as they come.
        window: the slopes to search.
        grey_step: what grey values were rounded to multiples of.
        noise: noise of the grey values, or of each channel; None to estimate it.
        gains: those of the last multi-view, where its slopes are the hypothesis; None to look for
            them.
    """
    cameras = Cameras(views.x_steps, views.y_steps, views.reference)
    known, drift = views.mending, None
    expected = views.row_errors or RowErrors.none(len(views.images))
    rows = expected if known is None else known.rows
    pictures = _mended(views.images, rows)
    first = first_match(_grey(pictures), cameras, window)
    if known is not None:
        light = known.light
    elif first.is_told:
        light = _no_light(pictures)
    else:
        left = find_row_errors(_grey(pictures), cameras, first, expected.per_slope)
        light = None
        drift = RowDrift(expected, left, np.hypot(views.x_steps, views.y_steps))
        if left.any:
            rows = expected.plus(left)
            pictures = _mended(views.images, rows)
            first = replace(first, pictures=_grey(pictures))
    known_noise = None if known is None else known.noise
    if pictures.ndim == 4:
        images, agreement, light = merge_channels(pictures, cameras, first, grey_step, noise, light)
        return Fitted(images, agreement, Mending(rows, light, known_noise, drift), None, first)
    equal = equalise(pictures, cameras, first, None if light is None else light[0], gains)
    mending = Mending(rows, (equal.light,), known_noise, drift)
    return Fitted(equal.images, equal.agreement, mending, equal.gains, first)


def _grey(pictures: Image) -> Image:
    return luminance(pictures) if pictures.ndim == 4 else pictures


def _mended(pictures: Image, rows: RowErrors) -> Image:
    if not rows.any or pictures.ndim == 3:
        return cast("Image", rows.mended(pictures))
    channels = [rows.mended(np.ascontiguousarray(pictures[..., c])) for c in range(3)]
    return cast("Image", np.stack(channels, axis=-1))


def _no_light(pictures: Image) -> tuple[Light, ...]:
    channels = pictures.shape[3] if pictures.ndim == 4 else 1
    return ((None,) * len(pictures),) * channels
