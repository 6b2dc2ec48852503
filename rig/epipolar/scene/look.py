"""Features of a scene where a calibration has them, whether views have turned by little or much.

A first match finds them wherever they are; what it finds is measured. Where a texture repeats
itself, though, another period across the lines looks like a turn: then the nearest one counts.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.fine import FineMeter
from rig.epipolar.scene.match import match_features
from rig.epipolar.scene.motion import Before, standing
from rig.epipolar.scene.numbers import numbers_of, pose_slice, with_numbers
from rig.epipolar.scene.rays import Misfit, misfit
from rig.epipolar.scene.rows import grid_features
from rig.epipolar.scene.solve import across_px, fit_scene
from rig.errors import CalibrationError
from rig.geometry.bundle.geometry_of import rodrigues_by_shared
from rig.geometry.rig_geometry import RigGeometry

TURN_DEG = 0.5
"""How far a view may have turned, 1 sigma about each axis, before the scene is asked."""
_FEWEST = 40
_CHANCE = 4.0
"""Scatter of a first match, in its sigmas of half a pixel, that matches by chance have."""
_ANOTHER_PX = 1.0
"""Rows that moved farther may be those of another period of a texture that repeats itself."""
_AS_MANY, _AS_WELL = 0.5, 2.0
"""What features about the calibration must reach to explain it: their number, their scatter."""


def look(
    geometry: RigGeometry,
    pictures: Sequence[Sequence[NDArray[np.generic]]],
    full_scale: int,
    earlier: Sequence[Before | None] = (),
) -> SceneFeatures:
    """Measure the features of one scene in some pictures of it.

    Args:
        geometry: the calibration.
        pictures: raw multi-views, each per view (H, W) grey.
        full_scale: largest grey value.
        earlier: of each multi-view what the reference showed shortly before, where that matters.

    Raises:
        CalibrationError: a view shares too few features with the reference, or too few stand still.
    """
    known = replace(geometry, covariance=None)
    coarse = match_features(pictures[0], geometry.reference, 0, full_scale)
    _require(coarse, known)
    fit = fit_scene(known, turning_prior(known), coarse)
    meter = FineMeter.of(fit.geometry, coarse[fit.fits])
    measured = [meter.measure(images, 0) for images in pictures]
    moved_px = rows_moved_px(known, numbers_of(fit.geometry) - numbers_of(known), fit.at)
    if moved_px > _ANOTHER_PX or fit.scatter > _CHANCE:
        nearer = _measured_nearer(known, coarse[fit.fits], pictures)
        if _explains(known, nearer, measured):
            measured = nearer
    _require(SceneFeatures.joined(measured), known)
    still = [
        one
        if was is None
        else one[standing(was, images[geometry.reference], one.reference_px, full_scale)]
        for one, images, was in zip(
            measured, pictures, earlier or [None] * len(pictures), strict=True
        )
    ]
    features = SceneFeatures.joined(still)
    _require(features, known, "that stand still while the views are exposed")
    return features


def _measured_nearer(
    known: RigGeometry, coarse: SceneFeatures, pictures: Sequence[Sequence[NDArray[np.generic]]]
) -> list[SceneFeatures]:
    """Measure features where the calibration has them, at any distance that was found."""
    meter = FineMeter.of(known, coarse)
    alone = replace(meter, coarse=coarse[np.zeros(len(coarse), np.bool_)])
    return [alone.measure(images, 0) for images in pictures]


def _explains(
    known: RigGeometry, nearer: Sequence[SceneFeatures], found: Sequence[SceneFeatures]
) -> bool:
    """Whether features about the calibration fit as well as those that tell a large turn.

    Where texture repeats itself across the lines, a turn by one period fits as well as none.
    """
    fits = [
        fit_scene(known, turning_prior(known), SceneFeatures.joined(one))
        for one in (nearer, found)
        if sum(map(len, one)) >= _FEWEST
    ]
    if len(fits) < 2:
        return False
    plain, turned = fits
    as_many = float(plain.fits.sum()) >= _AS_MANY * float(turned.fits.sum())
    return as_many and plain.scatter <= _AS_WELL * turned.scatter


def axes_of(geometry: RigGeometry) -> Float:
    """(P, 3 (V - 1)) how turns of the views about their own axes move the numbers."""
    places = [
        place
        for view in range(len(geometry.names))
        for place in range(*pose_slice(geometry, view).indices(geometry.parameter_count))[:3]
    ]
    return rodrigues_by_shared(geometry)[:, places]


def turning_prior(geometry: RigGeometry) -> Float:
    """(P, P) covariance of the numbers by turns of which nothing is known yet."""
    axes = axes_of(geometry)
    return np.radians(TURN_DEG) ** 2 * axes @ axes.T


def rows_moved_px(geometry: RigGeometry, numbers: Float, at: Misfit) -> float:
    """How far rows move, px rms, at the distances of the scene, by a change of the numbers."""
    inverse = np.percentile(at.inverse_per_mm, [10.0, 50.0, 90.0])
    turned = with_numbers(geometry, numbers_of(geometry) + numbers)
    grid = grid_features(turned, np.maximum(inverse, 1e-6))
    across = across_px(misfit(geometry, grid), grid)
    return float(np.sqrt(np.nanmean(across**2)))


def _require(features: SceneFeatures, geometry: RigGeometry, which: str = "") -> None:
    for view, (name, count) in enumerate(
        zip(geometry.names, features.seen.sum(axis=0).tolist(), strict=True)
    ):
        if view != geometry.reference and count < _FEWEST:
            raise CalibrationError(
                f"drift from a scene asked for, {name} shares {count} features with "
                f"{geometry.names[geometry.reference]}{which and ' '}{which}; {_FEWEST} are needed",
                advice="look at something with texture, sharp and lit, that stands still",
            )
