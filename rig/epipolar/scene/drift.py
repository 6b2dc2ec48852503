"""Whether views have turned since a calibration, by the rows of an ordinary scene.

Turns t of the views move features by J D t beside what the calibration does not know, J c with c of
covariance C, and noise of information W. With C taken into the noise (generalised least squares:
G. A. F. Seber and A. J. Lee, "Linear Regression Analysis", 2003, 3.10), t has the information
H = D'(I + A C)^-1 A D, A = J'W J, and t'H t over its freedoms follows an F distribution while
nothing has turned. The noise is what parts of the picture differ by once the turns are taken out:
neighbours err together, and the same feature errs alike in picture after picture of one scene, so
long looks at one scene do not make it surer than its features are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher

from rig.arrays import Float
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.fine import FineMeter
from rig.epipolar.scene.match import match_features
from rig.epipolar.scene.numbers import numbers_of, pose_slice, with_numbers
from rig.epipolar.scene.rays import Misfit, derivatives, misfit
from rig.epipolar.scene.rows import grid_features
from rig.epipolar.scene.solve import across_px, fit_scene
from rig.errors import CalibrationError
from rig.geometry.bundle.depth_error import depth_gradient
from rig.geometry.bundle.geometry_of import rodrigues_by_shared
from rig.geometry.rig_geometry import RigGeometry

_TURN_DEG = 0.5
"""How far a view may have turned, 1 sigma about each axis, before the scene is asked."""
_CELLS = 6
"""Parts of the picture, each way, whose means tell the noise."""
_LEAST_SPARE = 6
_TOLD = 4.0
"""A direction of turning is told by rows that know it so many times as well as `_TURN_DEG`."""
_RIDGE = 1e-9
_FEWEST = 40
_AT_MM = 1000.0
_K = 2.0


@dataclass(frozen=True, slots=True)
class SceneDrift:
    """What the rows of one scene tell of V views."""

    turned_deg: Float
    """(V, 3) about x, y and z of each view, against the reference; 0 for the reference."""
    sigma_deg: Float
    """(V, 3) 1 sigma; about y, which rows hardly tell, under the assumption of `depth_pct`."""
    rows_px: float
    """How far rows have moved, rms over picture and views."""
    probability: float
    """Of rows that lie so far off, or farther, while nothing has turned."""
    alone: int | None
    """The view whose turn alone explains them best; None where several turned, or one of a pair."""
    freedoms: int
    """Directions of turning that rows tell."""
    depth_pct: tuple[float, float]
    """How far depth at 1 m is off, k = 2, if views have turned towards each other no farther than
    about the other axes."""
    features: int


def look(
    geometry: RigGeometry, pictures: Sequence[Sequence[NDArray[np.generic]]], full_scale: int
) -> SceneFeatures:
    """Measure the features of one scene in some pictures of it.

    Args:
        geometry: the calibration.
        pictures: raw multi-views, each per view (H, W) grey.
        full_scale: largest grey value.

    Raises:
        CalibrationError: a view shares too few features with the reference.
    """
    known = replace(geometry, covariance=None)
    coarse = match_features(pictures[0], geometry.reference, 0, full_scale)
    _require(coarse, known)
    fit = fit_scene(known, _turning(known), coarse)
    meter = FineMeter.of(fit.geometry, coarse[fit.fits])
    features = SceneFeatures.joined([meter.measure(images, 0) for images in pictures])
    _require(features, known)
    return features


def scene_drift(geometry: RigGeometry, covariance: Float, features: SceneFeatures) -> SceneDrift:
    """Compare features of one scene with a calibration.

    Args:
        geometry: the calibration.
        covariance: (P, P) of its numbers.
        features: of one scene, from `look`.
    """
    known = replace(geometry, covariance=None)
    prior = covariance + _turning(known)
    fit = fit_scene(known, prior + _RIDGE * np.diag(np.diag(prior)), features)
    turning = _axes(known)
    information, pull = _linear(fit.geometry, known, fit.at, features, fit.weight / fit.scatter**2)
    noise, spare = _noise(fit.at, features, fit.weight, fit.scatter, turning.shape[1], known)
    information, pull = information / noise, pull / noise
    with_unknown = np.eye(len(information)) + information @ covariance
    told = turning.T @ np.linalg.solve(with_unknown, information @ turning)
    told, toward = (told + told.T) / 2.0, turning.T @ np.linalg.solve(with_unknown, pull)
    chances = _chances(known, told, toward, spare)
    probability, alone = least_chance(chances)
    turned, sure = _turned(told, toward)
    views = len(known.names)
    angles, sigmas = np.zeros((views, 3)), np.zeros((views, 3))
    others = [view for view in range(views) if view != known.reference]
    angles[others] = np.degrees(turned.reshape(-1, 3))
    sigmas[others] = np.degrees(np.sqrt(np.diag(sure)).reshape(-1, 3))
    return SceneDrift(
        angles,
        sigmas,
        _rows_px(known, turning @ turned, fit.at),
        probability,
        alone,
        _chance(told, toward, spare)[1],
        _depth_pct(known, turning, turned, sure),
        int(fit.fits.sum()),
    )


def _axes(geometry: RigGeometry) -> Float:
    """(P, 3 (V - 1)) how turns of the views about their own axes move the numbers."""
    places = [
        place
        for view in range(len(geometry.names))
        for place in range(*pose_slice(geometry, view).indices(geometry.parameter_count))[:3]
    ]
    return rodrigues_by_shared(geometry)[:, places]


def _turning(geometry: RigGeometry) -> Float:
    axes = _axes(geometry)
    return np.radians(_TURN_DEG) ** 2 * axes @ axes.T


def _linear(
    at_fit: RigGeometry, known: RigGeometry, at: Misfit, features: SceneFeatures, weight: Float
) -> tuple[Float, Float]:
    """Information (P, P) and pull (P,) about the numbers of the calibration."""
    moves = derivatives(at_fit, features, at).reshape(-1, known.parameter_count)
    away = numbers_of(at_fit) - numbers_of(known)
    residual = at.residual.ravel() + moves @ away
    weights = np.repeat(weight, at.residual[0].size)
    weighed = moves * weights[:, None]
    return weighed.T @ moves, weighed.T @ residual


def _noise(
    at: Misfit,
    features: SceneFeatures,
    weight: Float,
    scatter: float,
    fitted: int,
    geometry: RigGeometry,
) -> tuple[float, int]:
    """How much more parts of the picture differ than independent features would; and freedoms."""
    camera = geometry.cameras[geometry.reference]
    size = np.array([camera.width_px, camera.height_px])
    cell = np.clip((features.reference_px * _CELLS / size).astype(int), 0, _CELLS - 1)
    key = cell[:, 1] * _CELLS + cell[:, 0]
    across = across_px(at, features) / features.sigma_px / scatter
    squares: list[float] = []
    for view in range(len(geometry.cameras)):
        own = np.isfinite(across[:, view]) & (weight > 0.0)
        for one in np.unique(key[own]):
            part = own & (key == one)
            power = float(weight[part].sum())
            squares.append(float(weight[part] @ across[part, view]) ** 2 / power)
    spare = max(len(squares) - fitted, _LEAST_SPARE)
    return max(1.0, float(np.sum(squares)) / spare), spare


def _chances(
    geometry: RigGeometry, told: Float, toward: Float, spare: int
) -> dict[int | None, float]:
    """Return the probability of such rows by chance, against several things that may have turned.

    One view alone, whichever, the reference among them; and all of them at once (None). A pull
    towards three turns is told from chance much sooner than one towards all of them: with four
    views beside the reference, three freedoms and not twelve share what one view has turned.
    """
    found: dict[int | None, float] = {None: _chance(told, toward, spare)[0]}
    views = len(geometry.names)
    if views == 2:
        return found
    others = [view for view in range(views) if view != geometry.reference]
    for place, view in enumerate(others):
        one = np.zeros((len(toward), 3))
        one[3 * place : 3 * place + 3] = np.eye(3)
        found[view] = _chance(one.T @ told @ one, one.T @ toward, spare)[0]
    # A turn of the reference is one of all others, each about the reference's axes.
    together = np.concatenate([geometry.cam_from_reference[view].rotation for view in others])
    found[geometry.reference] = _chance(together.T @ told @ together, together.T @ toward, spare)[0]
    return found


def least_chance(chances: Mapping[int | None, float]) -> tuple[float, int | None]:
    """Return the probability of the least of some chances, and whose it is.

    By Bonferroni's inequality, whatever they have in common, it is their number times the least.
    """
    whose = min(chances, key=lambda one: chances[one])
    return min(1.0, len(chances) * chances[whose]), whose


def _chance(told: Float, toward: Float, spare: int) -> tuple[float, int]:
    """Probability of such a pull by chance, over the directions that rows tell; and how many."""
    sizes, axes = np.linalg.eigh(told)
    clear = sizes > (_TOLD / np.radians(_TURN_DEG)) ** 2
    freedoms = int(clear.sum())
    if not freedoms:
        return 1.0, 0
    squares = float(np.sum((axes[:, clear].T @ toward) ** 2 / sizes[clear]))
    return float(fisher.sf(squares / freedoms, freedoms, spare)), freedoms


def _turned(told: Float, toward: Float) -> tuple[Float, Float]:
    """Turns (3 (V - 1),), rad, and their covariance.

    Rows hardly tell a turn about y: it is taken to be no larger than those about x and z.
    """
    loose = np.full(len(toward), np.radians(_TURN_DEG))
    first = np.linalg.inv(told + np.diag(loose**-2.0))
    size = np.abs(first @ toward) + np.sqrt(np.diag(first))
    beside = np.maximum(size[0::3], size[2::3])
    loose[1::3] = np.minimum(loose[1::3], beside)
    covariance = np.asarray(np.linalg.inv(told + np.diag(loose**-2.0)), np.float64)
    return covariance @ toward, covariance


def _rows_px(geometry: RigGeometry, numbers: Float, at: Misfit) -> float:
    """How far rows move, px rms, at the distances of the scene, by a change of the numbers."""
    inverse = np.percentile(at.inverse_per_mm, [10.0, 50.0, 90.0])
    turned = with_numbers(geometry, numbers_of(geometry) + numbers)
    grid = grid_features(turned, np.maximum(inverse, 1e-6))
    across = across_px(misfit(geometry, grid), grid)
    return float(np.sqrt(np.nanmean(across**2)))


def _depth_pct(
    geometry: RigGeometry, turning: Float, turned: Float, sure: Float
) -> tuple[float, float]:
    """Error of depth at 1 m in the middle of the picture, per cent, from and to, k = 2."""
    camera = geometry.cameras[geometry.reference]
    middle = np.array([[(camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0]])
    # The calibration is off by minus what has turned.
    by_turns = -depth_gradient(geometry, _AT_MM, middle)[0] @ turning * (100.0 / _AT_MM)
    off, sigma = float(by_turns @ turned), float(np.sqrt(by_turns @ sure @ by_turns))
    return off - _K * sigma, off + _K * sigma


def _require(features: SceneFeatures, geometry: RigGeometry) -> None:
    for view, (name, count) in enumerate(
        zip(geometry.names, features.seen.sum(axis=0).tolist(), strict=True)
    ):
        if view != geometry.reference and count < _FEWEST:
            raise CalibrationError(
                f"drift from a scene asked for, {name} shares {count} features with "
                f"{geometry.names[geometry.reference]}; {_FEWEST} are needed",
                advice="look at something with texture, sharp and lit",
            )
