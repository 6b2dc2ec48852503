"""Averages slopes over time where nothing moves: a Kalman filter per pixel.

State and measurement are one slope each (R. E. Kalman, "A new approach to linear filtering and
prediction problems", J. Basic Engineering 82, 1960); a fading memory keeps the gain above
1 / `frames`. What moves is taken as measured: the filter begins anew where an innovation fails its
chi-square test (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, "Estimation with applications to
tracking and navigation", 2001, 5.4.2), or where those of a neighbourhood lean to one side together,
now or lately.

Averaging takes away only what differs from frame to frame. What is left is measured, by how far the
averaged slopes around each pixel scatter about straight lines (where they bend or jump, that is
more); sigma tells this, and never more than the measurements did.
"""

from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar import Label, SlopeMap

Map = NDArray[np.float32]
Mask = NDArray[np.bool_]

_GATE = np.float32(3.0**2)
"""Of a squared innovation over its variance: one still pixel in 370 begins anew by chance."""
_LOSS = np.float32(3.0**2)
"""A variance that grows so much says that the views contradict the slope: the scene has changed."""
_FADING = np.float32(0.3)
"""Weight of the newest frame in what innovations are said to be lately."""
_POOL_PX = 31
"""Side of the neighbourhoods that tell the share of sigma that differs from frame to frame."""
_TOGETHER_PX = 15
_ALIKE = np.float32(0.16)
"""Variance of the mean innovation of such a neighbourhood over that of a pixel: stitching makes
neighbours alike."""
_APART_PX = 12
"""Neighbours so far apart share no pixels that stitching joins."""
_STRAIGHT = np.float32(4.0**2)
"""Of a squared second difference over its variance: beyond is a jump and no scatter."""
_SMOOTH = np.float32(0.1)
"""Share of the variance that does not differ from frame to frame and is kept whatever the scatter:
errors that change little over a neighbourhood do not show in it."""
_NONE: Final = np.float32(0)
_LEAST = np.float32(1e-3)
"""Below such a share, innovations are rounding."""


@dataclass(frozen=True, eq=False, slots=True)
class _State:
    """What is known after some frames; every array is (H, W)."""

    slope_px: Map
    variance: Map
    """Of the slope, as if all of sigma differed from frame to frame."""
    told: Map
    """Mean variance of the measurements that went in."""
    lean: Map
    """Fading mean of the innovations over their standard deviations."""
    lean_variance: Map
    """Of that mean, over that of one innovation."""
    age: Map
    """Innovations that went in since the filter began anew."""
    squares: Map
    """Fading mean of their squares, 0 where the filter began anew, over a neighbourhood."""
    going: Map
    """Share of the pixels there where it did not."""

    @classmethod
    def unknown(cls, like: Map) -> "_State":
        """Return that before the first frame."""
        nothing, none = np.full_like(like, np.nan), np.zeros_like(like)
        return cls(nothing, nothing, nothing, none, none, none, none, none)


class SlopeFilter:
    """Filters the slope maps of one camera, in their order.

    Args:
        frames: how far back it remembers, 2 or more.
    """

    def __init__(self, frames: int) -> None:
        self._least_gain = np.float32(1.0 / frames)
        self._state: _State | None = None

    def forget(self) -> None:
        """Begin anew: the next map has nothing to do with the last."""
        self._state = None

    def filtered(self, measured: SlopeMap) -> SlopeMap:
        """Return a map joined with those before it; pixels without an answer stay without.

        Args:
            measured: of the next multi-view, of the size of those before.
        """
        last = self._state or _State.unknown(measured.slope_px)
        variance = measured.sigma_px**2
        with np.errstate(invalid="ignore", divide="ignore"):
            innovation = measured.slope_px - last.slope_px
            promised = last.variance + variance
            squared = innovation**2 / promised
            goes_on = (squared <= _GATE) & (variance <= _LOSS * last.told)
            step = np.where(goes_on, innovation / np.sqrt(promised), _NONE).astype(np.float32)
        squares = _faded(last.squares, np.where(goes_on, squared, _NONE))
        going = _faded(last.going, goes_on.astype(np.float32))
        share = squares / np.maximum(going, _LEAST)
        weight = np.maximum(_FADING, 1 / (last.age + 1))
        lean = (last.lean + weight * (step - last.lean)).astype(np.float32)
        lean_variance = (1 - weight) ** 2 * last.lean_variance + weight**2
        lately = _mean_of(lean, goes_on)
        alike = _GATE * _ALIKE * np.maximum(share, _LEAST)
        moves = (_mean_of(step, goes_on) ** 2 > alike) | (lately**2 > alike * lean_variance)
        goes_on &= ~moves
        with np.errstate(invalid="ignore"):
            gain = np.maximum(last.variance / promised, self._least_gain)
            joined_px = last.slope_px + gain * innovation
            kept = (1 - gain) ** 2 * last.variance + gain**2 * variance
            told = last.told + gain * (variance - last.told)
            # What leans lately lags behind: so far off may the average be.
            behind = (lately * (1 - gain)) ** 2 * promised
        slope_px = np.where(goes_on, joined_px, measured.slope_px)
        variance = np.where(goes_on, kept, variance)
        self._state = _State(
            slope_px=slope_px,
            variance=variance,
            told=np.where(goes_on, told, measured.sigma_px**2),
            lean=np.where(goes_on, lean, _NONE),
            lean_variance=np.where(goes_on, lean_variance, _NONE),
            age=np.where(goes_on, last.age + 1, _NONE),
            squares=squares,
            going=going,
        )
        differs = np.minimum(share, np.float32(1))
        least = differs * kept + _SMOOTH * (1 - differs) * told
        left = np.maximum(_scatter(slope_px, self._state.told) * told, least)
        sigma_px = np.minimum(np.sqrt(left + behind), np.sqrt(told))
        return replace(
            measured,
            slope_px=slope_px,
            sigma_px=np.where(goes_on, sigma_px, measured.sigma_px).astype(np.float32, copy=False),
            label=sided(measured.label, slope_px),
        )


def _scatter(slope_px: Map, variance: Map) -> Map:
    """Variance of slopes about straight lines, over what each is told to have, (H, W).

    From second differences of three pixels in a row or a column, over the neighbourhood; 1 where
    none are straight.
    """
    total, count = np.zeros_like(slope_px), np.zeros_like(slope_px)
    for axis in (0, 1):
        if slope_px.shape[axis] <= 2 * _APART_PX:
            continue
        first, middle, last = (
            np.moveaxis(slope_px, axis, 0)[begin : begin - 2 * _APART_PX or None]
            for begin in (0, _APART_PX, 2 * _APART_PX)
        )
        promised = 6 * np.moveaxis(variance, axis, 0)[_APART_PX:-_APART_PX]
        with np.errstate(invalid="ignore"):
            squared = (first - 2 * middle + last) ** 2 / promised
            is_straight = squared <= _STRAIGHT
        for target, values in ((total, squared), (count, np.float32(1))):
            part = np.moveaxis(target, axis, 0)[_APART_PX:-_APART_PX]
            part += np.where(is_straight, values, _NONE)
    total, count = (_mean(one, _POOL_PX) for one in (total, count))
    return np.where(count > _LEAST, total / np.maximum(count, _LEAST), np.float32(1))


def sided(label: NDArray[np.uint8], slope_px: Map) -> NDArray[np.uint8]:
    """Labels that name a side of the focus distance, by the side that changed slopes are on."""
    names_a_side = (label == Label.NEARER) | (label == Label.BEYOND)
    with np.errstate(invalid="ignore"):
        side = np.where(slope_px > 0, np.uint8(Label.NEARER), np.uint8(Label.BEYOND))
    return np.where(names_a_side, side, label)


def _faded(before: Map, now: Map) -> Map:
    """Mean over neighbourhoods, joined with that of the frames before."""
    return (before + _FADING * (_mean(now, _POOL_PX) - before)).astype(np.float32, copy=False)


def _mean(values: Map, side_px: int) -> Map:
    """Mean over the neighbourhood of every pixel; the picture goes on as in a mirror."""
    return np.asarray(cv2.blur(values, (side_px, side_px)), np.float32)


def _mean_of(values: Map, known: Mask) -> Map:
    """Mean of the known values around every pixel; 0 where there are none."""
    total = _mean(known * values, _TOGETHER_PX)
    share = _mean(known.astype(np.float32), _TOGETHER_PX)
    return (total / np.maximum(share, _LEAST)).astype(np.float32, copy=False)
