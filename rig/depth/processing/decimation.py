"""Fewer pixels: each square of a map becomes one, by the surface that most of it shows.

Slopes of a square are parted where they leave a gap wider than a jump; the largest part is averaged
by inverse variance, the others are left out, so that no value lies between two surfaces. Errors of
neighbours are taken as wholly alike (stitching makes them so): sigma is the weighted mean of the
sigmas, and does not fall with the number of pixels.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.depth.depth_map import DepthMap
from rig.depth.processing.temporal import sided
from rig.epipolar import Label, SlopeMap

Map = NDArray[np.float32]
Mask = NDArray[np.bool_]

_LEAST_SIGMA = 1e-9


def decimated(
    slopes: SlopeMap, depth: DepthMap | None, factor: int, jump_px: float
) -> tuple[SlopeMap, DepthMap | None]:
    """Return maps of 1 / factor of the width and height; what is left over at the end is cut.

    Args:
        slopes: of one multi-view.
        depth: of these slopes; None where there is none.
        factor: side of the squares, px.
        jump_px: difference of neighbouring slopes from which they belong to two surfaces.
    """
    members = _largest_surface(_squares(slopes.slope_px, factor), jump_px)
    slope_px, sigma_px = _averaged(slopes.slope_px, slopes.sigma_px, members, factor)
    label = sided(_commonest(_squares(slopes.label, factor), members), slope_px)
    fewer = replace(slopes, slope_px=slope_px, sigma_px=sigma_px, label=label)
    if depth is None:
        return fewer, None
    members = members & (_squares(depth.label, factor) != Label.NONE)
    depth_mm, sigma_mm = _averaged(depth.depth_mm, depth.sigma_mm, members, factor)
    label = sided(_commonest(_squares(depth.label, factor), members), slope_px)
    return fewer, DepthMap(depth_mm, sigma_mm, label)


def decimated_picture(image: NDArray[np.generic], factor: int) -> NDArray[np.generic]:
    """Return the mean of every square of a grey picture (H, W), in its own type."""
    mean = _squares(image, factor).mean(axis=-1, dtype=np.float64)
    return np.rint(mean).astype(image.dtype)


def _squares(values: NDArray[np.generic], factor: int) -> NDArray[np.generic]:
    """Return the pixels of every square, (h, w, factor^2)."""
    height, width = (size // factor for size in values.shape)
    cut = values[: height * factor, : width * factor]
    apart = cut.reshape(height, factor, width, factor).swapaxes(1, 2)
    return apart.reshape(height, width, factor * factor)


def _largest_surface(slope_px: NDArray[np.generic], jump_px: float) -> Mask:
    """Which pixels of every square (h, w, n) are on the surface that most are on.

    The nearer one where two are as large.
    """
    members = np.isfinite(slope_px)
    highest = np.where(members, slope_px, -np.inf).max(axis=-1)
    lowest = np.where(members, slope_px, np.inf).min(axis=-1)
    has_jump = highest - lowest > jump_px
    members[has_jump] = _largest_part(slope_px[has_jump], jump_px)
    return members


def _largest_part(slope_px: NDArray[np.generic], jump_px: float) -> Mask:
    """See `_largest_surface`, of some squares (N, n)."""
    order = np.argsort(slope_px, axis=-1)  # NaN comes last
    ranked = np.take_along_axis(slope_px, order, axis=-1).astype(np.float64)
    known = np.isfinite(ranked)
    with np.errstate(invalid="ignore"):
        begins = np.diff(ranked, axis=-1) > jump_px
    surface = np.concatenate([np.zeros_like(begins[..., :1], np.int64), begins.cumsum(axis=-1)], -1)
    count = np.zeros(ranked.shape, np.int64)
    for number in range(ranked.shape[-1]):
        count[..., number] = ((surface == number) & known).sum(axis=-1)
    largest = ranked.shape[-1] - 1 - np.argmax(count[..., ::-1], axis=-1)
    in_order = (surface == largest[..., None]) & known
    members = np.empty_like(in_order)
    np.put_along_axis(members, order, in_order, axis=-1)
    return members


def _averaged(values: Map, sigmas: Map, members: Mask, factor: int) -> tuple[Map, Map]:
    """Mean of the members by inverse variance and its sigma, (h, w); NaN where there are none."""
    sigma = np.maximum(_squares(sigmas, factor).astype(np.float64), _LEAST_SIGMA)
    weight = np.where(members, sigma**-2, 0.0)
    total = weight.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(members, weight * _squares(values, factor), 0.0).sum(axis=-1) / total
        spread = np.where(members, weight * sigma, 0.0).sum(axis=-1) / total
    return mean.astype(np.float32), spread.astype(np.float32)


def _commonest(label: NDArray[np.generic], members: Mask) -> NDArray[np.uint8]:
    """The commonest label of the members, (h, w); of those as common the one that says less."""
    counts = np.stack([((label == one) & members).sum(axis=-1) for one in reversed(Label)], -1)
    commonest = np.uint8(len(Label) - 1) - counts.argmax(axis=-1).astype(np.uint8)
    return np.where(members.any(axis=-1), commonest, np.uint8(Label.NONE))
