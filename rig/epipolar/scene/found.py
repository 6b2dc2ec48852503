"""From pictures of ordinary scenes to a geometry: features, a first fit, the same ones measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.smooth_field import fit_field, is_worth_it
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.fine import FineMeter
from rig.epipolar.scene.match import match_features
from rig.epipolar.scene.prior import Sureness, prior_of, with_lens_terms
from rig.epipolar.scene.solve import SceneFit, across_px, fit_scene
from rig.errors import CalibrationError
from rig.geometry.rig_geometry import RigGeometry

FEWEST = 25
"""Features that every view must share with the reference; with fewer nothing is told."""
_MEASURED = 2
"""Times that features are measured: the second time by the geometry of the first."""
MOST_FIELD_PX = 0.1
"""Smooth misfit of the rows of a view, rms, above which it is another lens than was thought."""
_FOR_LENSES = 200
"""Features without which ten lens terms would be chance."""
_NOTICEABLE_PX, _CLUSTERED = 0.05, 2.0
"""Smooth misfit, rms, and clustering of what is left from which lens terms are looked for."""
_EXPECTED_PX = 3.0
LensTerms = Literal["auto", "kept", "freed"]


@dataclass(frozen=True, slots=True)
class FoundGeometry:
    """What the scenes gave."""

    fit: SceneFit
    features: SceneFeatures
    fields: tuple["RowField | None", ...]
    """Of each view; None for the reference."""
    before: tuple["RowField | None", ...] | None
    """The same before lenses were freed; None where they were not."""


@dataclass(frozen=True, slots=True)
class RowField:
    """How the features of one view lie across their lines."""

    rms_px: float
    """Of a smooth field through them, without what its own noise makes."""
    scatter_px: float
    """Of single features about their lines, robust 1 sigma."""
    about_px: float
    """Of single features about the smooth field."""
    is_sure: bool
    """Whether the field explains features that it was not fitted to."""


def find_geometry(
    pictures: Sequence[Sequence[NDArray[np.generic]]],
    full_scale: int,
    start: RigGeometry,
    sure: Sureness,
    lens_terms: LensTerms = "auto",
) -> FoundGeometry:
    """Find rotations, focal lengths and places of the cameras from scenes.

    Lens terms are freed where what is left without them is a smooth field that no chance explains.

    Args:
        pictures: raw multi-views of scenes, each per view (H, W) grey.
        full_scale: largest grey value.
        start: cameras and places as far as they are known.
        sure: how sure that is.
        lens_terms: whether lenses are kept as they are, freed, or freed where need be.

    Raises:
        CalibrationError: the views share too few features.
    """
    geometry, prior = start, prior_of(start, sure)
    if lens_terms == "freed":
        geometry, prior = with_lens_terms(geometry, prior)
    coarse = SceneFeatures.joined(
        [
            match_features(images, start.reference, number, full_scale)
            for number, images in enumerate(pictures)
        ]
    )
    _require(coarse, start, len(pictures))
    fit = fit_scene(geometry, prior, coarse)
    first = features = coarse[fit.fits]
    _require(first, start, len(pictures))
    for _ in range(_MEASURED):
        features, fit = _measured(pictures, geometry, prior, fit, first)
    fields, before = row_fields(fit, features), None
    if lens_terms == "auto" and _is_bent(fit, fields):
        geometry, prior = with_lens_terms(start, prior)
        before, fit = fields, fit_scene(geometry, prior, features)
        features, fit = _measured(pictures, geometry, prior, fit, first)
        fields = row_fields(fit, features)
    return FoundGeometry(fit, features, fields, before)


def _measured(
    pictures: Sequence[Sequence[NDArray[np.generic]]],
    geometry: RigGeometry,
    prior: Float,
    fit: SceneFit,
    first: SceneFeatures,
) -> tuple[SceneFeatures, SceneFit]:
    """Measure features by what a fit found, and fit them."""
    meter = FineMeter.of(fit.geometry, first)
    measured = SceneFeatures.joined(
        [meter.measure(images, number) for number, images in enumerate(pictures)]
    )
    _require(measured, geometry, len(pictures))
    return measured, fit_scene(geometry, prior, measured)


def _is_bent(fit: SceneFit, fields: Sequence["RowField | None"]) -> bool:
    """Whether what is left across the lines is smooth, and no chance."""
    return fit.fits.sum() >= _FOR_LENSES and any(
        one is not None
        and one.rms_px > _NOTICEABLE_PX
        and (one.is_sure or fit.clustering > _CLUSTERED)
        for one in fields
    )


def row_fields(fit: SceneFit, features: SceneFeatures) -> tuple[RowField | None, ...]:
    """Judge what is left across the lines of every view, from the features that fit."""
    geometry = fit.geometry
    camera = geometry.cameras[geometry.reference]
    across, fits = across_px(fit.at, features), fit.fits
    found: list[RowField | None] = []
    for view in range(len(geometry.cameras)):
        own = fits & np.isfinite(across[:, view])
        if view == geometry.reference or own.sum() < FEWEST:
            found.append(None)
            continue
        (x, y), values = features.reference_px[own].T, across[own, view]
        sigma, shape = features.sigma_px[own, view], (camera.height_px, camera.width_px)
        field = fit_field(x, y, values, sigma, shape, _EXPECTED_PX)
        smooth = field.at(x, y)
        power = float(np.mean(smooth**2) - np.mean(field.sigma_at(x, y) ** 2))
        found.append(
            RowField(
                max(power, 0.0) ** 0.5,
                _robust(values),
                _robust(values - smooth),
                is_worth_it(x, y, values, sigma, shape, _EXPECTED_PX),
            )
        )
    return tuple(found)


def _robust(values: Float) -> float:
    return 1.4826 * float(np.median(np.abs(values)))


def _require(features: SceneFeatures, geometry: RigGeometry, pictures: int) -> None:
    counts = features.seen.sum(axis=0)
    for view, name in enumerate(geometry.names):
        if view != geometry.reference and counts[view] < FEWEST:
            raise CalibrationError(
                f"calibration from a scene asked for, {name} shares {counts[view]} features with "
                f"{geometry.names[geometry.reference]} in {pictures} pictures; {FEWEST} are needed",
                advice="show scenes with texture that both see, sharp and lit, near and far; are "
                "the views named rightly?",
            )
