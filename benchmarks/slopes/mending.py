"""Rows and light of a real pair, mended from the frames alone: what a reference map starts from.

Shares nothing with `rig`: corners matched by SIFT (Lowe, IJCV 60, 2004), more of them tracked from
where SGBM sees them (Lucas and Kanade, IJCAI 1981), robust polynomials of their vertical offsets,
and of the differences of grey values at matches of SGBM.
"""

from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compare.baselines import BASELINES
from rig.epipolar import RectifiedViews

Grey = NDArray[np.uint8]
Map = NDArray[np.float32]

_OFF_ROW_PX = 12.0
"""Rows may miss by so much."""
_RATIO = 0.8
"""The best match is to be so much nearer than the second."""
_ROWS_ORDER, _LIGHT_ORDER = 2, 4
_ROUNDS = 12
_SHARED_PX = 1.0
_TRACK_PX = 3.0
"""Corners tracked farther than this from where they should be are lost."""
_WHITE = np.uint8(255)
_FROM_START = cv2.OPTFLOW_USE_INITIAL_FLOW
_SEMI_GLOBAL = next(method for method in BASELINES if method.name == "SGBM-HH")


def consistent(left: Grey, right: Grey, range_px: tuple[float, float]) -> Map:
    """SGBM-HH of both views, kept where both tell the same disparity within 1 px; else NaN."""
    x, y = np.array([0.0, 1.0]), np.zeros(2)
    ours = _SEMI_GLOBAL.run(RectifiedViews(np.stack([left, right]), x, y, 0), range_px)
    turned = np.stack([right[:, ::-1], left[:, ::-1]])
    theirs = _SEMI_GLOBAL.run(RectifiedViews(turned, x, y, 0), range_px)[:, ::-1]
    rows, columns = np.indices(ours.shape)
    there = np.rint(columns - np.nan_to_num(ours)).astype(int)
    inside = np.isfinite(ours) & (there >= 0) & (there < ours.shape[1])
    shared = theirs[rows, np.clip(there, 0, ours.shape[1] - 1)]
    with np.errstate(invalid="ignore"):
        return np.where(inside & (np.abs(shared - ours) <= _SHARED_PX), ours, np.float32(np.nan))


def mended(left: Grey, right: Grey, range_px: tuple[float, float]) -> tuple[Grey, Map, Map]:
    """Move the rows of the right view onto those of the left one, then give it the same light.

    Returns:
        The right view mended; by how much it lay below the rows of the left one (H, W), px; how
        much brighter it was (H, W), grey levels.
    """
    height, width = left.shape
    rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)

    def straightened(offset_px: Map) -> Grey:
        moved = cv2.remap(
            right, columns, rows + offset_px, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(moved, np.uint8)

    matches = _matched(left, right, range_px)
    offset_px = _field(*matches, _ROWS_ORDER, left.shape)
    disparity_px = consistent(left, straightened(offset_px), range_px)
    tracks = _tracked(left, right, disparity_px, offset_px)
    at_px, low_px = (np.concatenate([matches[k], tracks[k]], axis=-1) for k in (0, 1))
    offset_px = _field(at_px, low_px, _ROWS_ORDER, left.shape)
    straight = straightened(offset_px)
    disparity_px = consistent(left, straight, range_px)
    found = np.isfinite(disparity_px)
    there = columns - np.where(found, disparity_px, np.float32(0.0))
    values = cv2.remap(straight.astype(np.float32), there, rows, cv2.INTER_LINEAR)
    smooth = [cv2.GaussianBlur(view.astype(np.float32), (0, 0), 1.0) for view in (values, left)]
    places = np.stack([there[found], rows[found]])[:, ::7]
    excess = np.asarray(smooth[0] - smooth[1], np.float32)[found][::7]
    brighter = _field(places, excess, _LIGHT_ORDER, left.shape)
    mended_right = np.clip(np.rint(straight - brighter), 0, 255).astype(np.uint8)
    return mended_right, offset_px, brighter


def _matched(left: Grey, right: Grey, range_px: tuple[float, float]) -> tuple[Map, Map]:
    """Places (2, N) in the right view of corners, and how far below their row of the left view."""
    finder = cv2.SIFT.create(nfeatures=6000, contrastThreshold=0.01)
    here, words = finder.detectAndCompute(left, None)
    there, others = finder.detectAndCompute(right, None)
    at = np.array([point.pt for point in here], np.float32)
    to = np.array([point.pt for point in there], np.float32)
    moved = at[:, None, :] - to[None, :, :]
    low, high = range_px
    allowed = (moved[..., 0] >= low) & (moved[..., 0] <= high)
    allowed &= np.abs(moved[..., 1]) <= _OFF_ROW_PX
    likeness = np.asarray(words, np.float32) @ np.asarray(others, np.float32).T
    squared = [np.square(np.asarray(w, np.float32)).sum(axis=1) for w in (words, others)]
    distance = np.sqrt(np.maximum(squared[0][:, None] + squared[1] - 2.0 * likeness, 0.0))
    distance[~allowed] = np.inf
    best = distance.argmin(axis=1)
    two = np.partition(distance, 1, axis=1)[:, :2]
    index = np.arange(len(at))
    good = np.isfinite(two[:, 0]) & (two[:, 0] < _RATIO * two[:, 1])
    good &= distance.argmin(axis=0)[best] == index
    places = np.stack([to[best[good], 0], at[good, 1]])
    return places, to[best[good], 1] - at[good, 1]


def _tracked(left: Grey, right: Grey, disparity_px: Map, offset_px: Map) -> tuple[Map, Map]:
    """The same of corners of the left view, from where the right one should show them."""
    corners = cv2.goodFeaturesToTrack(left, 3000, 0.005, 5, mask=np.isfinite(disparity_px) * _WHITE)
    at = np.asarray(corners, np.float32).reshape(-1, 2)
    u, v = (at[:, k].astype(int) for k in (0, 1))
    there = np.clip(np.rint(at[:, 0] - disparity_px[v, u]).astype(int), 0, left.shape[1] - 1)
    start = np.stack([at[:, 0] - disparity_px[v, u], at[:, 1] + offset_px[v, there]], axis=1)
    to, is_found, _ = cv2.calcOpticalFlowPyrLK(
        left, right, at, start.copy(), winSize=(15, 15), maxLevel=0, flags=_FROM_START
    )
    good = (is_found.ravel() > 0) & (np.abs(to - start).max(axis=1) < _TRACK_PX)
    return np.stack([to[good, 0], at[good, 1]]), to[good, 1] - at[good, 1]


def _field(at_px: Map, values: Map, order: int, shape: tuple[int, int]) -> Map:
    """A polynomial of both coordinates through scattered values, outliers held down (Tukey)."""
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]].astype(np.float32)
    A = _powers(at_px[0], at_px[1], order, shape)
    weight = np.ones(len(values))
    parameters = np.zeros(A.shape[1])
    parameters[0] = np.median(values)
    for _ in range(_ROUNDS):
        residual = values - A @ parameters
        scale = max(1.4826 * float(np.median(np.abs(residual))), 0.05)
        weight = np.clip(1.0 - (residual / (4.7 * scale)) ** 2, 0.0, None)
        parameters = np.linalg.lstsq(A * weight[:, None], values * weight, rcond=None)[0]
    fitted = _powers(columns.ravel(), rows.ravel(), order, shape) @ parameters
    return fitted.reshape(shape).astype(np.float32)


def _powers(u: Map, v: Map, order: int, shape: tuple[int, int]) -> NDArray[np.float64]:
    x = 2.0 * u.astype(np.float64) / shape[1] - 1.0
    y = 2.0 * v.astype(np.float64) / shape[0] - 1.0
    pairs = [(i, j) for i, j in product(range(order + 1), repeat=2) if i + j <= order]
    return np.stack([x**i * y**j for i, j in pairs], axis=1)
