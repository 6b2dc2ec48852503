"""How sure the line fit of a board is: from its own residuals, and from the lenses' asymmetry."""

from dataclasses import dataclass

import cv2
import numpy as np

from rig.arrays import Float

_REACH_SIDES = 0.5
"""Reach of the correlation of residuals, in sides of a square: both flanks of an edge count as one,
for what is even about an edge to cancel, and the next edge is not far away."""
_REACH_PX = (2.0, 12.0)
_TINY = 1e-300
_LEAST_SPARE = 0.25
_CERTAIN = 2.0
"""Sigmas above which views are taken to show edges of different asymmetry."""


@dataclass(frozen=True, slots=True)
class Scores:
    """What every pixel of a converged least-squares fit of a plane says."""

    pixels: Float
    """(2, N)."""
    design: Float
    """(3, N) derivatives of the slope by a, b, c."""
    rate: Float
    """(V, N) derivatives of the values by the slope."""
    residual: Float
    """(V, N) grey levels."""
    normal: Float
    """(3, 3)."""


def plane_covariance(scores: Scores, side_px: float) -> Float:
    """Covariance (3, 3) of the plane, from the residuals as they are.

    Noise of a camera is correlated: by smoothing, compression, denoising; and what is no noise,
    such as another blur in one view, cancels between the two flanks of an edge. So the products of
    the scores of neighbouring pixels are summed up: White, Econometrica 48 (1980), with spatial
    correlation by Conley, Journal of Econometrics 92 (1999).
    """
    weight = (scores.rate**2).sum(axis=0)
    # The plane has taken its three parameters' share of what neighbours have in common.
    share = float(_summed((weight / weight.sum())[None], scores.pixels, side_px)[0, 0])
    spare = max(1.0 - len(scores.design) * share, _LEAST_SPARE)
    return _summed(_influence(scores), scores.pixels, side_px) / spare


def asymmetry_px(scores: Scores, smoother: Scores, bend: Float, side_px: float) -> float:
    """By how much the slope depends on where in an asymmetric edge its place is taken to be.

    A lens with coma, or one that is not centred, shows edges with a longer tail on one side. Least
    squares, the centroid and a fitted symmetric edge then have different places for one and the
    same edge, and where the views' tails differ, different slopes; no picture tells which is right.
    A third derivative of the texture, free in every view, makes the slope that of the centroids.

    Args:
        scores: of the fit.
        smoother: the same plane in pictures smoothed so much that interpolation between the pixels
            has no asymmetry of its own.
        bend: (2, N) change of their gradient (2, N) by some more blur.
        side_px: of a square.

    Returns:
        Slope of the centroids less that of the fit at the board's centre, px per view step; 0 where
        it is within the noise.
    """
    power = np.linalg.inv(bend @ bend.T)
    rate, design = smoother.rate, smoother.design
    mixed = np.einsum("kn,vn,jn->vkj", design, rate, bend, optimize=True) @ power
    normal = smoother.normal - np.einsum("vkj,ji,vli->kl", mixed, bend @ bend.T, mixed)
    bread = np.linalg.inv(normal)
    moved = bread @ _centroid_scores(smoother, mixed, bend, smoother.residual).sum(axis=1)
    left = smoother.residual + rate * (moved @ design)
    left -= (left @ bend.T) @ power @ bend
    # What every pixel does to the slope of the centroids, less what it does to that of the fit.
    influence = bread[0] @ _centroid_scores(smoother, mixed, bend, left)
    influence += _influence(scores)[0]
    sigma = float(np.sqrt(_summed(influence[None], scores.pixels, side_px)[0, 0]))
    return float(moved[0]) if abs(moved[0]) > _CERTAIN * sigma else 0.0


def _centroid_scores(smoother: Scores, mixed: Float, bend: Float, residual: Float) -> Float:
    """(3, N) what every pixel's residual adds to the right-hand side, bends eliminated."""
    eliminated = np.einsum("vkj,jn,vn->kn", mixed, bend, residual, optimize=True)
    return eliminated - smoother.design * (smoother.rate * residual).sum(axis=0)


def _influence(scores: Scores) -> Float:
    """(3, N) what every pixel takes from the plane."""
    score = scores.design * (scores.rate * scores.residual).sum(axis=0)
    return np.linalg.solve(scores.normal, score)


def _summed(influence: Float, pixels: Float, side_px: float) -> Float:
    """Sum of products of influences (K, N) over all pairs of pixels that are near each other."""
    low = pixels.min(axis=1).astype(np.intp)
    column, row = pixels.astype(np.intp) - low[:, None]
    reach_px = float(np.clip(_REACH_SIDES * side_px, *_REACH_PX))
    # Single precision holds what a plane's influences span once each is scaled.
    scale = np.abs(influence).max(axis=1, initial=_TINY)
    field = np.zeros((len(influence), int(row.max()) + 1, int(column.max()) + 1), np.float32)
    field[:, row, column] = influence / scale[:, None]
    near = np.stack(
        [
            cv2.GaussianBlur(plane, (0, 0), reach_px, borderType=cv2.BORDER_CONSTANT)
            for plane in field
        ]
    )
    flat = field.reshape(len(field), -1).astype(np.float64)
    products = flat @ near.reshape(len(field), -1).T * np.outer(scale, scale)
    # The blur's kernel is one at no distance.
    return products * (2 * np.pi * reach_px**2)
