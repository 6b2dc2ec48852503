"""The geometry that fits the features of ordinary scenes, as sure as they make it.

Maximum a posteriori by Gauss-Newton; every feature's depth is eliminated by projection (G. H. Golub
and V. Pereyra, SIAM J. Numer. Anal. 10, 1973). Wrong matches lose their weight as the scale of what
fits falls (S. Geman and D. E. McClure, "Statistical methods for tomographic image reconstruction",
Bull. ISI 52, 1987).
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.arrays import Flags, Float
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.numbers import numbers_of, with_numbers
from rig.epipolar.scene.rays import Misfit, derivatives, misfit
from rig.geometry.rig_geometry import RigGeometry

_ROUNDS, _FEWEST_ROUNDS = 25, 4
_SETTLED = 1e-4
"""Squared change, in sigmas of what is found, after which nothing is left to gain."""
_DOUBT = 3.0
"""Scales from which a feature loses its weight."""
_SORTINGS = 4
_OUT = 0.1
"""Weight below which one is taken for a wrong match."""
_AT_ONCE = 4_000_000
"""Numbers of derivatives in memory."""
_CELLS = 4
_SMALLEST = 1e-3
"""Least scatter, in sigmas: features that fit exactly would leave nothing to weigh by."""


@dataclass(frozen=True, slots=True)
class SceneFit:
    """What one solve found."""

    geometry: RigGeometry
    """With its covariance."""
    at: Misfit
    """Of all features."""
    weight: Float
    """(N,) of each feature, 0 to 1."""
    scatter: float
    """What features are off by, in units of their sigmas."""
    clustering: float
    """Neighbours err together: the mean of those of one part of a picture varies so many times as
    much as that of independent ones, 1 at least. It is in the covariance."""

    @property
    def fits(self) -> Flags:
        """(N,) features that were not left out."""
        return self.weight > _OUT


def fit_scene(start: RigGeometry, prior: Float, features: SceneFeatures) -> SceneFit:
    """Fit a geometry to features.

    Args:
        start: the rig as it is known.
        prior: (P, P) covariance of its numbers; those of no variance stay.
        features: at least one.
    """
    free = np.flatnonzero(np.diag(prior) > 0.0)
    unit = np.asarray(np.linalg.cholesky(prior[np.ix_(free, free)]), np.float64)
    first = numbers_of(start)
    away = np.zeros(len(free))
    geometry = replace(start, covariance=None)
    at, scatter, weight = misfit(geometry, features), 1.0, np.ones(len(features))
    information = np.eye(len(free))
    for number in range(_ROUNDS):
        scatter, weight = _weighed(at)
        information, pull = _normal(geometry, features, at, weight / scatter**2, free, unit)
        curvature = information + np.eye(len(free))
        change = np.linalg.solve(curvature, pull - away)
        away = away + change
        numbers = first.copy()
        numbers[free] += unit @ away
        geometry = with_numbers(geometry, numbers)
        at = misfit(geometry, features)
        if number >= _FEWEST_ROUNDS and float(change @ curvature @ change) < _SETTLED:
            break
    scatter, weight = _weighed(at)
    clustering = _clustering(at, features, weight, scatter, geometry)
    covariance = np.zeros_like(prior)
    known = np.linalg.inv(information / clustering + np.eye(len(free)))
    covariance[np.ix_(free, free)] = unit @ known @ unit.T
    covariance = (covariance + covariance.T) / 2.0
    return SceneFit(replace(geometry, covariance=covariance), at, weight, scatter, clustering)


def _weighed(at: Misfit) -> tuple[float, Float]:
    """Scatter of what fits, and the weight of every feature (N,)."""
    squares, spare = at.squares[at.known], at.spare[at.known]
    # Median of a chi-squared over its freedoms (E. B. Wilson, M. M. Hilferty, PNAS 17, 1931).
    usual = (1.0 - 2.0 / (9.0 * spare)) ** 3
    relative, scatter = squares / usual, np.inf
    for _ in range(_SORTINGS):  # wrong matches make the first median too large
        near = relative[squares <= (_DOUBT * scatter) ** 2]
        scatter = max(float(np.sqrt(np.median(near))) if len(near) else 1.0, _SMALLEST)
    weight = (1.0 + at.squares / (_DOUBT * scatter) ** 2) ** -2
    return scatter, np.where(at.known, weight, 0.0)


def _normal(
    geometry: RigGeometry,
    features: SceneFeatures,
    at: Misfit,
    weight: Float,
    free: np.ndarray[tuple[int], np.dtype[np.intp]],
    unit: Float,
) -> tuple[Float, Float]:
    """Information (F, F) and pull (F,) in sigmas of the prior."""
    information, pull = np.zeros((len(free), len(free))), np.zeros(len(free))
    of_one = at.residual[0].size * geometry.parameter_count
    count = max(1, _AT_ONCE // of_one)
    for start in range(0, len(features), count):
        part = np.zeros(len(features), np.bool_)
        part[start : start + count] = True
        own = Misfit(
            at.residual[part], at.by_inverse[part], at.inverse_per_mm[part], at.known[part]
        )
        moves = derivatives(geometry, features[part], own)[..., free] @ unit
        flat = moves.reshape(-1, len(free))
        weights = np.repeat(weight[part], flat.shape[0] // int(part.sum()))
        information += (flat * weights[:, None]).T @ flat
        pull += flat.T @ (weights * own.residual.ravel())
    return information, pull


def across_px(at: Misfit, features: SceneFeatures) -> Float:
    """(N, V) by how much features lie across their epipolar lines, px; NaN where not shown."""
    length = np.linalg.norm(at.by_inverse, axis=2)
    across = (
        at.by_inverse[..., 0] * at.residual[..., 1] - at.by_inverse[..., 1] * at.residual[..., 0]
    ) / np.where(length > 0.0, length, np.nan)
    return across * features.sigma_px


def _clustering(
    at: Misfit, features: SceneFeatures, weight: Float, scatter: float, geometry: RigGeometry
) -> float:
    """How much more the means of parts of the pictures vary than those of independent errors."""
    camera = geometry.cameras[geometry.reference]
    size = np.array([camera.width_px, camera.height_px])
    cell = np.clip((features.reference_px * _CELLS / size).astype(int), 0, _CELLS - 1)
    key = (features.picture * _CELLS + cell[:, 1]) * _CELLS + cell[:, 0]
    across = across_px(at, features) / features.sigma_px
    ratios: list[float] = []
    for view in range(len(geometry.cameras)):
        own = np.isfinite(across[:, view]) & (weight > _OUT)
        for one in np.unique(key[own]):
            part = across[own & (key == one), view]
            ratios.append(len(part) * float(part.mean()) ** 2 / scatter**2)
    return max(1.0, float(np.mean(ratios))) if ratios else 1.0
