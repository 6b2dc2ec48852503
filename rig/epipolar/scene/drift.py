"""Whether views have turned since a calibration, by the rows of an ordinary scene.

Turns t of the views move features by J D t beside what the calibration does not know, J c with c of
covariance C, and noise of information W. With C taken into the noise (generalised least squares:
G. A. F. Seber and A. J. Lee, "Linear Regression Analysis", 2003, 3.10), t has the information
H = D'(I + A C)^-1 A D, A = J'W J, and t'H t over its freedoms follows an F distribution while
nothing has turned. The noise is what parts of the picture differ by once the turns are taken out:
neighbours err together, and the same feature errs alike in picture after picture of one scene, so
long looks at one scene do not make it surer than its features are.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.arrays import Float, Index
from rig.epipolar.scene.chances import (
    Evidence,
    chance,
    chances,
    hypotheses,
    least_chance,
    likeliest,
)
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.look import TURN_DEG, axes_of, rows_moved_px, turning_prior
from rig.epipolar.scene.numbers import numbers_of
from rig.epipolar.scene.rays import derivatives
from rig.epipolar.scene.solve import SceneFit, across_px, fit_scene
from rig.epipolar.scene.verdict import FITTING
from rig.errors import CalibrationError
from rig.geometry.bundle.depth_error import depth_gradient
from rig.geometry.rig_geometry import RigGeometry

_CELLS = 6
"""Parts of the picture, each way, whose means tell the noise."""
_FEWEST_PARTS = 9
"""Of a view, with features: three are used up by its turns."""
_TOLD_RAD = float(np.radians(TURN_DEG)) / 4.0
"""A direction of turning is told by rows that know it four times as well as `TURN_DEG`."""
_RIDGE = 1e-9
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


def scene_drift(geometry: RigGeometry, covariance: Float, features: SceneFeatures) -> SceneDrift:
    """Compare features of one scene with a calibration.

    Args:
        geometry: the calibration.
        covariance: (P, P) of its numbers.
        features: of one scene, from `look`.

    Raises:
        CalibrationError: too few of them fit, or they lie in too few parts of the picture.
    """
    known = replace(geometry, covariance=None)
    prior = covariance + turning_prior(known)
    fit = fit_scene(known, prior + _RIDGE * np.diag(np.diag(prior)), features)
    share = float(fit.fits.mean())
    if share < FITTING:
        raise CalibrationError(
            f"drift from a scene asked for, {100 * share:.0f} % of {len(features)} features fit "
            f"cameras that may have turned; {100 * FITTING:.0f} % are needed",
            advice="look at something that stands still and does not repeat itself",
        )
    turning = axes_of(known)
    evidence = _evidence(fit, known, features, turning.shape[1])
    told, toward = evidence.against(covariance, turning, evidence.noise)
    turnings = hypotheses(known, turning)
    probability = least_chance(chances(evidence, covariance, turnings, _TOLD_RAD, known.reference))
    alone = likeliest(evidence, covariance, turnings)
    turned, sure = _turned(told, toward)
    views = len(known.names)
    angles, sigmas = np.zeros((views, 3)), np.zeros((views, 3))
    others = [view for view in range(views) if view != known.reference]
    angles[others] = np.degrees(turned.reshape(-1, 3))
    sigmas[others] = np.degrees(np.sqrt(np.diag(sure)).reshape(-1, 3))
    return SceneDrift(
        angles,
        sigmas,
        rows_moved_px(known, turning @ turned, fit.at),
        probability,
        alone,
        chance(told, toward, evidence.spare, _TOLD_RAD)[1],
        _depth_pct(known, turning, turned, sure),
        int(fit.fits.sum()),
    )


def _evidence(fit: SceneFit, known: RigGeometry, features: SceneFeatures, fitted: int) -> Evidence:
    """Return what the features tell about the numbers of the calibration.

    Raises:
        CalibrationError: they lie in too few parts of the picture to tell their noise.
    """
    count = known.parameter_count
    moves = derivatives(fit.geometry, features, fit.at).reshape(-1, count)
    weights = np.repeat(fit.weight / fit.scatter**2, fit.at.residual[0].size)
    weighed, residual = moves * weights[:, None], fit.at.residual.ravel()
    away = numbers_of(fit.geometry) - numbers_of(known)
    part = _parts(features, known)
    _, own = np.unique(part, return_inverse=True)
    left = (weighed * residual[:, None]).reshape(len(features), -1, count).sum(axis=1)
    parts = np.zeros((int(own.max()) + 1, count))
    np.add.at(parts, own, left)
    noise, spare = _noise(fit, features, part, fitted, known)
    return Evidence(weighed.T @ moves, weighed.T @ (residual + moves @ away), parts, noise, spare)


def _parts(features: SceneFeatures, geometry: RigGeometry) -> Index:
    """(N,) which part of the reference's picture each feature lies in."""
    camera = geometry.cameras[geometry.reference]
    size = np.array([camera.width_px, camera.height_px])
    cell = np.clip((features.reference_px * _CELLS / size).astype(int), 0, _CELLS - 1)
    return np.asarray(cell[:, 1] * _CELLS + cell[:, 0], np.intp)


def _noise(
    fit: SceneFit, features: SceneFeatures, part: Index, fitted: int, geometry: RigGeometry
) -> tuple[float, int]:
    """How much more parts of the picture differ than independent features would; and freedoms.

    Views share the reference's errors, half of all that parts differ by: of n of them over v
    views 4 n / (v + 3) are free (F. E. Satterthwaite, Biometrics Bulletin 2, 1946).

    Raises:
        CalibrationError: a view shares features in too few parts.
    """
    across = across_px(fit.at, features) / features.sigma_px / fit.scatter
    squares: list[float] = []
    for view, name in enumerate(geometry.names):
        own = np.isfinite(across[:, view]) & (fit.weight > 0.0)
        found = np.unique(part[own])
        if view != geometry.reference and len(found) < _FEWEST_PARTS:
            raise CalibrationError(
                f"drift from a scene asked for, {name} shares features with "
                f"{geometry.names[geometry.reference]} in {len(found)} of the {_CELLS**2} parts of "
                f"the picture; {_FEWEST_PARTS} are needed to tell drift from noise",
                advice="look at something with texture all over the picture, sharp and lit",
            )
        for one in found:
            inside = own & (part == one)
            power = float(fit.weight[inside].sum())
            squares.append(float(fit.weight[inside] @ across[inside, view]) ** 2 / power)
    left, others = len(squares) - fitted, len(geometry.names) - 1
    return max(1.0, float(np.sum(squares)) / left), int(4 * left / (others + 3))


def _turned(told: Float, toward: Float) -> tuple[Float, Float]:
    """Turns (3 (V - 1),), rad, and their covariance.

    Rows hardly tell a turn about y: it is taken to be no larger than those about x and z.
    """
    loose = np.full(len(toward), np.radians(TURN_DEG))
    first = np.linalg.inv(told + np.diag(loose**-2.0))
    size = np.abs(first @ toward) + np.sqrt(np.diag(first))
    beside = np.maximum(size[0::3], size[2::3])
    loose[1::3] = np.minimum(loose[1::3], beside)
    covariance = np.asarray(np.linalg.inv(told + np.diag(loose**-2.0)), np.float64)
    return covariance @ toward, covariance


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
