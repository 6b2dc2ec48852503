"""Measures features anew, to a twentieth of a pixel, in pictures that nearly fit each other.

Rectified by a first geometry, all pictures are of one orientation and one scale: patches of the
house (`rig.epipolar.mending.patches`) then follow a point through all views, and a first match of
small pictures finds points also where features are rare. Their places go back to the raw pictures,
exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.first_match import FirstMatch, first_match
from rig.epipolar.mending.patches import (
    Patches,
    Places,
    directions,
    distinctness,
    find_patches,
    most_distinct,
    most_distinct_near,
)
from rig.epipolar.resample import Resampler
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.search.window import Cameras, window_of
from rig.geometry.rectification import Rectification, rectify
from rig.geometry.rig_geometry import RigGeometry

_PATCHES = 1600
"""Begun in one picture."""
_SMALLEST_CELL_PX = 4
_SMALL_REACH_PX, _REACH_PX = 2.5, 2.0
"""Farthest that a patch may lie from where the match, and its smaller picture, put it."""
_SURE_PX, _LEAST_SIGMA_PX = 0.25, 0.05
"""Patches less sure slide along an edge or drown in noise; none is surer than this."""
_ROOM, _ROOM_PX = 0.3, 3.0
"""Slopes are searched so much beyond those of the features: share of their span, and px."""
_KEY_BITS = 20
_ENDS_PCT = (2.0, 98.0)


@dataclass(frozen=True, slots=True)
class FineMeter:
    """Measures features in pictures of one rig."""

    rectification: Rectification
    resampler: Resampler
    range_px: tuple[float, float]
    """Slopes to look for, px per view step of the common frame."""
    coarse: SceneFeatures
    """Of the first match; they are measured besides."""

    @classmethod
    def of(cls, geometry: RigGeometry, coarse: SceneFeatures) -> "FineMeter":
        """Look where the features of a first match are.

        Args:
            geometry: brings them to lines within a pixel or two.
            coarse: features that fit it.
        """
        lengths = [float(np.linalg.norm(p.translation_mm)) for p in geometry.cam_from_reference]
        rectification = rectify(geometry, max(lengths))
        return cls(
            rectification, resampler_of(rectification), _slopes(rectification, coarse), coarse
        )

    def measure(self, images: Sequence[NDArray[np.generic]], picture: int) -> SceneFeatures:
        """Measure one multi-view.

        Args:
            images: raw, per view (H, W) grey.
            picture: its number.
        """
        level = self.resampler(images)
        cameras, reference = self.cameras, self.rectification.geometry.reference
        first = first_match(
            level, cameras, window_of(self.rectification.shape, self.range_px, None)
        )
        pictures = _Pictures.of(level, first, reference)
        own = self.coarse[self.coarse.picture == picture]
        begun = np.rint(self.rectification.rectified_px(reference, own.reference_px)).astype(
            np.intp
        )
        rows, columns = pictures.places(begun)
        view_px = np.full((len(rows), len(images), 2), np.nan)
        sigma_px = np.ones((len(rows), len(images)))
        for view in range(len(images)):
            steps = float(cameras.x_steps[view]), float(cameras.y_steps[view])
            if view == reference or np.hypot(*steps) == 0.0:
                continue
            away_px = self.rectification.rectified_px(view, own.view_px[:, view]) - begun
            found = pictures.followed(view, steps, begun, away_px)
            place = np.searchsorted(_keys(rows, columns), _keys(found.rows, found.columns))
            along, across = directions(*steps)
            seen_px = (
                np.stack([found.columns, found.rows], axis=1)
                + found.along_px[:, None] * along
                + found.across_px[:, None] * across
            )
            valid = self._is_shown(view, seen_px)
            view_px[place[valid], view] = self.rectification.raw_px(view, seen_px[valid])
            finer = self.rectification.finer(view)
            sigma_px[place, view] = finer * np.hypot(found.sigma_px, _LEAST_SIGMA_PX)
        reference_px = np.stack([columns, rows], axis=1).astype(np.float64)
        everywhere = SceneFeatures(
            np.full(len(rows), picture),
            self.rectification.raw_px(reference, reference_px),
            view_px,
            sigma_px,
        )
        return everywhere[everywhere.shared & self._is_shown(reference, reference_px)]

    @property
    def cameras(self) -> Cameras:
        """Where the views stand in the common frame."""
        one = self.rectification
        return Cameras(one.x_steps, one.y_steps, one.geometry.reference)

    def _is_shown(self, view: int, px: Float) -> NDArray[np.bool_]:
        height, width = self.rectification.shape
        x = np.clip(np.rint(px[:, 0]).astype(int), 0, width - 1)
        y = np.clip(np.rint(px[:, 1]).astype(int), 0, height - 1)
        return self.resampler.valid[view][y, x]


@dataclass(frozen=True, slots=True)
class _Pictures:
    """Rectified pictures of one instant, at two sizes."""

    small: NDArray[np.float32]
    """(V, h, w)."""
    soft: NDArray[np.float32]
    """(V, H, W) mean over 3 x 3 pixels: what interpolation would smooth is gone before."""
    strength: NDArray[np.float32]
    """(H, W) how distinct the reference's places are."""
    near: tuple[Places, Places]
    """Rows and columns (N,) of distinct places of the small reference."""
    slope_px: NDArray[np.float32]
    """(h, w) of the first match, px of the small pictures per view step."""
    factor: int
    reference: int

    @classmethod
    def of(cls, level: NDArray[np.float32], first: FirstMatch, reference: int) -> "_Pictures":
        soft = np.stack([cv2.blur(one, (3, 3)) for one in level])
        cell_px = max(_SMALLEST_CELL_PX, round((first.images[0].size / _PATCHES) ** 0.5))
        near = most_distinct(distinctness(first.images[reference]), cell_px)
        order = np.lexsort((near[1], near[0]))
        return cls(
            first.images,
            soft,
            distinctness(soft[reference]),
            (near[0][order], near[1][order]),
            first.slope_px,
            first.factor,
            reference,
        )

    def places(self, begun: Places) -> tuple[Places, Places]:
        """Rows and columns (N,) of distinct places and others (M, 2), by their keys."""
        near, factor = self.near, self.factor
        rows, columns = most_distinct_near(
            self.strength, near[0] * factor, near[1] * factor, factor
        )
        keys = np.unique(_keys(np.append(rows, begun[:, 1]), np.append(columns, begun[:, 0])))
        return keys >> _KEY_BITS, keys & ((1 << _KEY_BITS) - 1)

    def followed(
        self, view: int, steps: tuple[float, float], begun: Places, away_px: Float
    ) -> Patches:
        """Follow distinct places, and others (M, 2) about which is known, into a view."""
        pair, factor = [self.reference, view], self.factor
        begin_px = -np.hypot(*steps) * self.slope_px[self.near].astype(np.float64)
        (one, other), (own, seen) = self.small[pair], self.soft[pair]
        found = find_patches(
            one, other, *self.near, begin_px, np.zeros_like(begin_px), steps, _SMALL_REACH_PX
        )
        rows, columns = most_distinct_near(
            self.strength, factor * found.rows, factor * found.columns, factor
        )
        known = np.isfinite(away_px).all(axis=1)
        along, across = directions(*steps)
        rows = np.append(rows, begun[known, 1])
        columns = np.append(columns, begun[known, 0])
        along_px = np.append(factor * found.along_px, away_px[known] @ along)
        across_px = np.append(factor * found.across_px, away_px[known] @ across)
        found = find_patches(own, seen, rows, columns, along_px, across_px, steps, _REACH_PX)
        return found[found.sigma_px < _SURE_PX]


def _keys(rows: Places, columns: Places) -> Places:
    return (rows << _KEY_BITS) + columns


def resampler_of(rectification: Rectification) -> Resampler:
    """Return what brings raw pictures into the common frame."""
    cameras = rectification.geometry.cameras
    return Resampler(
        [rectification.raw_map_px(view) for view in range(len(cameras))],
        [(camera.height_px, camera.width_px) for camera in cameras],
    )


def _slopes(rectification: Rectification, features: SceneFeatures) -> tuple[float, float]:
    """Slopes that features have, with room beyond."""
    reference = rectification.geometry.reference
    own_px = rectification.rectified_px(reference, features.reference_px)
    found: list[Float] = []
    for view, steps in enumerate(zip(rectification.x_steps, rectification.y_steps, strict=True)):
        length = float(np.hypot(*steps))
        if view == reference or length == 0.0:
            continue
        away_px = rectification.rectified_px(view, features.view_px[:, view]) - own_px
        slope_px = -(away_px @ directions(*steps)[0]) / length
        found.append(slope_px[np.isfinite(slope_px)])
    low_px, high_px = np.percentile(np.concatenate(found), _ENDS_PCT).tolist()
    room_px = _ROOM * (high_px - low_px) + _ROOM_PX
    return low_px - room_px, high_px + room_px
