"""Stereo matchers that every engineer knows, as one kind of value: views in, slopes out.

OpenCV's matchers run with the settings of OpenCV's own sample `stereo_match.cpp`, for every scene.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compare.fill import fill_background
from rig.compare.pair import Pair, Span, best_pair
from rig.epipolar import RectifiedViews, estimate_slopes
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.views import Image
from rig.errors import SlopeError

Map = NDArray[np.float32]
Matcher = Callable[[Pair, int, int], Map]
"""Pair, first disparity, number of disparities -> disparities of the left image, NaN for none."""

_BLOCK_PX = 9
_SGBM_BLOCK_PX = 3
_NOWHERE = np.iinfo(np.uint16).max


@dataclass(frozen=True, slots=True)
class Method:
    """A way from views to slopes, by the name that tables show."""

    name: str
    run: Callable[[RectifiedViews, Span], Map]
    """Views and the range of slopes to search -> slopes of the reference view, NaN for none."""


def _stereo(name: str, match: Matcher, *, filled: bool = False) -> Method:
    def run(views: RectifiedViews, slope_range_px: Span) -> Map:
        pair = best_pair(views)
        first, count = pair.disparities(slope_range_px)
        height, width = pair.left.shape
        if width <= count + _BLOCK_PX or height <= _BLOCK_PX:
            raise SlopeError(
                f"asked {name} for {count} disparities, the pair has {width} px along its baseline "
                f"and {height} px across",
                advice="narrow slopes.range_px or give larger images",
            )
        disparity_px = match(pair, first, count)
        return pair.slope_px(fill_background(disparity_px) if filled else disparity_px)

    return Method(name, run)


def _block_match(pair: Pair, first: int, count: int) -> Map:
    """Sum of absolute differences in a window; the best wins, refined by a parabola.

    Scharstein and Szeliski, IJCV 47, 2002, section 3.
    """
    height, width = pair.left.shape
    cost = np.full((count, height, width), _NOWHERE, np.uint16)
    for index in range(count):
        shift = first + index
        here = slice(max(0, shift), min(width, width + shift))
        there = slice(max(0, -shift), min(width, width - shift))
        if here.start < here.stop:
            difference = cv2.absdiff(pair.left[:, here], pair.right[:, there])
            cost[index, :, here] = cv2.boxFilter(
                difference, cv2.CV_16U, (_BLOCK_PX, _BLOCK_PX), normalize=False
            )
    best = np.argmin(cost, axis=0)
    around = [
        np.take_along_axis(cost, np.clip(best + step, 0, count - 1)[None], axis=0)[0]
        for step in (-1, 0, 1)
    ]
    before, at, after = (level.astype(np.float32) for level in around)
    bend = before - 2.0 * at + after
    refined = (best > 0) & (best < count - 1) & (bend > 0.0)
    refined &= (before < _NOWHERE) & (after < _NOWHERE)
    offset = np.where(refined, (before - after) / (2.0 * np.maximum(bend, 1.0)), 0.0)
    disparity_px = (first + best + offset).astype(np.float32)
    return np.where(at < _NOWHERE, disparity_px, np.float32(np.nan))


def _opencv_block_match(pair: Pair, first: int, count: int) -> Map:
    """Konolige's block matcher as OpenCV has it."""
    matcher = cv2.StereoBM.create(count, _BLOCK_PX)
    matcher.setMinDisparity(first)
    matcher.setPreFilterCap(31)
    matcher.setTextureThreshold(10)
    matcher.setUniquenessRatio(15)
    matcher.setSpeckleWindowSize(100)
    matcher.setSpeckleRange(32)
    matcher.setDisp12MaxDiff(1)
    return _matched(matcher, pair, first, count)


def _semi_global(mode: int) -> Matcher:
    """Semi-global matching (Hirschmueller, PAMI 30, 2008), in blocks, as OpenCV has it."""

    def match(pair: Pair, first: int, count: int) -> Map:
        area = _SGBM_BLOCK_PX**2
        matcher = cv2.StereoSGBM.create(
            minDisparity=first,
            numDisparities=count,
            blockSize=_SGBM_BLOCK_PX,
            P1=8 * area,
            P2=32 * area,
            disp12MaxDiff=1,
            preFilterCap=63,
            uniquenessRatio=10,
            speckleWindowSize=100,
            speckleRange=32,
            mode=mode,
        )
        return _matched(matcher, pair, first, count)

    return match


def _matched(matcher: cv2.StereoMatcher, pair: Pair, first: int, count: int) -> Map:
    """Run a matcher of OpenCV; its fixed-point disparities in px, NaN for no answer.

    OpenCV answers only where the whole search fits into the image. The images therefore go on at
    their border with its last column, which gives the matcher its chance there.
    """
    before, after = max(0, first + count), max(0, -first)
    left, right = (
        cv2.copyMakeBorder(image, 0, 0, before, after, cv2.BORDER_REPLICATE)
        for image in (pair.left, pair.right)
    )
    computed = np.asarray(matcher.compute(left, right), np.int16)
    sixteenths = computed[:, before : before + pair.left.shape[1]]
    scale = cv2.StereoMatcher_DISP_SCALE
    disparity_px = sixteenths.astype(np.float32) / np.float32(scale)
    return np.where(sixteenths > (first - 1) * scale, disparity_px, np.float32(np.nan))


def rows_met(views: RectifiedViews, row_errors: RowErrors) -> RectifiedViews:
    """Return grey views for the matchers, with the rows that ours are given: they cannot mend them.

    Light that differs is left to them: each has its own way of not seeing it.
    """
    if not row_errors.any:
        return views
    mended, as_they_came = row_errors.mended(views.images), views.images.dtype
    if as_they_came != np.float32:
        top = float(np.iinfo(np.dtype(as_they_came).name).max)
        mended = np.clip(np.rint(mended), 0.0, top).astype(as_they_came)
    return replace(views, images=cast("Image", mended), row_errors=None, mending=None)


def _ours(views: RectifiedViews, slope_range_px: Span) -> Map:
    return estimate_slopes(views, slope_range_px).slope_px


_THREE_WAY = _semi_global(cv2.STEREO_SGBM_MODE_SGBM_3WAY)
_FULL = _semi_global(cv2.STEREO_SGBM_MODE_HH)

OURS = Method("rig", _ours)
BASELINES = (
    _stereo("SAD", _block_match),
    _stereo("StereoBM", _opencv_block_match),
    _stereo("SGBM-3WAY", _THREE_WAY),
    _stereo("SGBM-HH", _FULL),
)
FILLED = (
    _stereo("SGBM-3WAY filled", _THREE_WAY, filled=True),
    _stereo("SGBM-HH filled", _FULL, filled=True),
)
"""The same, holes filled: how matchers are compared at full density."""
