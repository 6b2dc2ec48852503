"""Brings all views to the reference's grey scale: gain and offset of every view, and light fields.

Cameras of one rig differ by a few per cent, and by what their lenses shade. A first match tells
which pixels show the same point; the grey values of these pairs give gain and offset by robust
regression, and what is left of them over the picture a smooth field (`rig.epipolar.mending.light`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.epipolar.mending.first_match import FirstMatch
from rig.epipolar.mending.gains import Gains, fit_gains, middle
from rig.epipolar.mending.light import LightField, fit_light
from rig.epipolar.mending.usable import saturation_grey
from rig.epipolar.rank import mean
from rig.epipolar.sampling import pad, sample_views
from rig.epipolar.search.window import Cameras
from rig.epipolar.views import Image

Light = tuple[LightField | None, ...]
"""Of each view; None where one gain and one offset say all."""

_PAIRS, _FEWEST_PAIRS = 2000, 100
_CLIPPED = 0.97


@dataclass(frozen=True, slots=True)
class Equalised:
    """Views on the grey scale of the reference."""

    images: NDArray[np.float32]
    """(V, H, W)."""
    agreement: Float
    """(V,) how well each view agrees with the reference in what it shows: 1 minus its median
    difference over that of unrelated pixels."""
    light: Light
    gains: Gains
    """Of every view."""


def equalise(
    images: Image,
    cameras: Cameras,
    first: FirstMatch,
    known: Light | None = None,
    gains: Gains | None = None,
) -> Equalised:
    """Bring every view to the grey scale of the reference view.

    Args:
        images: (V, H, W) grey values whose rows meet.
        cameras: where the views stand.
        first: which pixels show the same point.
        known: light fields of the last multi-view, to be taken as they are; None to look for them.
        gains: those of the last multi-view, to be taken as they are beside known light; None to
            look for them.
    """
    if known is not None and gains is not None:
        return Equalised(_equal(images, known, gains), np.ones(len(images)), known, gains)
    small, clip = first.images, saturation_grey(images)
    if known is not None:
        small = np.stack([_lit(one, field) for one, field in zip(small, known, strict=True)])
    pairs = _pair(small, cameras, first.slope_px, clip)
    gains, agreement = pairs.gains()
    if known is None:
        known = tuple(pairs.light(i, gains) for i in range(len(images)))
    return Equalised(_equal(images, known, gains), agreement, known, gains)


def _equal(images: Image, light: Light, gains: Gains) -> NDArray[np.float32]:
    """Apply light fields, then gains and offsets, to views (V, H, W)."""
    equal = np.empty(images.shape, np.float32)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            lit = _lit(images[i], light[i])
            np.multiply(lit, np.float32(gains.gain[i]), out=equal[i], dtype=np.float32)
            equal[i] += np.float32(gains.offset[i])

    run_in_bands(work, len(images))
    return equal


def _lit(image: NDArray[np.generic], field: LightField | None) -> NDArray[np.generic]:
    return image if field is None else field.of(image.astype(np.float32))


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Grey values of pixels that show the same point as some of the reference."""

    grey: NDArray[np.float32]
    """(V, N)."""
    target: NDArray[np.float32]
    """(N,) of the reference."""
    useful: NDArray[np.bool_]
    """(V, N) pairs that are seen and not clipped."""
    told: NDArray[np.bool_]
    """(V,) views with enough of them, the reference not among them."""
    x_px: Float
    """(V, N) where they lie in the view."""
    y_px: Float
    """(V, N)."""
    shape: tuple[int, int]
    """Height and width of the pictures that they are of, px."""

    def gains(self) -> tuple[Gains, Float]:
        """Gain and offset of each view, and how well it agrees with the reference, (V,)."""
        views = len(self.grey)
        found, agreement = Gains.none(views), np.ones(views)
        if self.told.any():
            x, useful = self.grey[self.told], self.useful[self.told]
            gains = fit_gains(x, self.target, useful)
            found.gain[self.told], found.offset[self.told] = gains.gain, gains.offset
            misfit = middle(np.abs(gains.misfit(x, self.target)), useful)
            shuffled = np.roll(self.target, len(self.target) // 2)
            unrelated = middle(np.abs(self.target - shuffled)[None], useful)
            agreement[self.told] = 1.0 - misfit / (unrelated + 1e-9)
        return found, agreement

    def light(self, view: int, gains: Gains) -> LightField | None:
        """Light field of a view; None where there is none, or nothing tells it."""
        if not self.told[view]:
            return None
        chosen = self.useful[view]
        return fit_light(
            self.x_px[view, chosen],
            self.y_px[view, chosen],
            self.grey[view, chosen].astype(np.float64),
            self.target[chosen].astype(np.float64),
            self.shape,
            float(gains.gain[view]),
            float(gains.offset[view]),
        )


def _pair(
    images: NDArray[np.generic], cameras: Cameras, slope_px: NDArray[np.float32], clip: float
) -> _Pairs:
    """Pair pixels of a grid by their slopes (H, W).

    Pairs with a member near the grey value at which pixels are clipped say nothing.
    """
    soft = np.stack([mean(image, 1) for image in images])  # what sampling would smooth is gone
    height, width = slope_px.shape
    stride = max(1, round((height * width / _PAIRS) ** 0.5))
    grid = np.mgrid[stride // 2 : height : stride, stride // 2 : width : stride]
    rows, columns = grid.reshape(2, -1)
    padded = pad(soft, cameras.x_steps, cameras.y_steps)
    slope = slope_px[rows, columns]
    seen, grey = sample_views(
        padded, slope_px.shape, cameras.x_steps, cameras.y_steps, rows, columns, slope
    )
    useful = seen & (grey < _CLIPPED * clip)
    useful &= useful[cameras.reference]
    told = np.count_nonzero(useful, axis=1) >= _FEWEST_PAIRS
    told[cameras.reference] = False
    x_px = columns - slope * cameras.x_steps[:, None]
    y_px = rows - slope * cameras.y_steps[:, None]
    return _Pairs(grey, grey[cameras.reference], useful, told, x_px, y_px, (height, width))
