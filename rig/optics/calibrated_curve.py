"""The depth-slope curve that a geometric calibration gives by itself, as sure as it is.

Rectified by their calibration, pinholes have the slope `m = f p / Z - m0` on the reference camera's
axis, exactly. What the calibration does not know moves the triangulated depth, and with it the
slope that a depth is taken for. On the axis these errors are sums of 1, 1 / Z and 1 / Z^2: errors
of orientation, of focal lengths and baselines, and of places along the axis; so the covariance of
all cameras becomes one of the three parameters of the law. What grows from there to the edges of
the picture becomes the covariance of a field term.
"""

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.curve import Curve, FieldTerm
from rig.curve.physical import Physical
from rig.errors import CurveError
from rig.geometry.bundle.depth_error import depth_gradient, picture_grid
from rig.geometry.rectification import Rectification

_NEAREST, _FARTHEST_PX = 0.3, 2.0
"""The outermost view shifts by this part of the width at the nearest distance, and by so many px at
the farthest: nearer it sees little of what the others see, farther everything is one distance."""
_DISTANCES, _FINE = 9, 2001
_LEAST = 0.1
"""Part of the mean variance that every place has in its weight: where errors happen to cancel, they
must not count for more than all others."""


def curve_of_calibration(
    rectification: Rectification, covariance: Float, *, max_sigma_pct: float, source: str
) -> Curve:
    """Return the curve that follows from a calibration.

    Method: first-order propagation (JCGM 100:2008, 5.1.2) of the covariance through least-squares
    triangulation, see `rig.geometry.bundle.depth_error`.

    Args:
        rectification: of the calibrated rig.
        covariance: (P, P) of the numbers of its geometry, in the order that `RigGeometry` tells.
        max_sigma_pct: the curve is valid where it knows depth to this, 1 sigma, per cent.
        source: what messages call the calibration.

    Raises:
        CurveError: nowhere does it know depth that well.
    """
    geometry, a_px_mm = rectification.geometry, rectification.inverse_law_px_mm
    camera = geometry.cameras[geometry.reference]
    steps = float(np.hypot(rectification.x_steps, rectification.y_steps).max())
    widest_px_mm = a_px_mm * steps
    ends_mm = widest_px_mm / (_NEAREST * camera.width_px), widest_px_mm / _FARTHEST_PX
    distances_mm = np.geomspace(*ends_mm, _DISTANCES)
    law = Physical(0.0, a_px_mm, -rectification.infinity_px)
    forward = geometry.cameras[geometry.reference].project(np.array([[0.0, 0.0, 1.0]]))
    pixels = np.concatenate([forward, picture_grid(camera.width_px, camera.height_px)])
    # (K, G, P): how the slope that a depth is taken for moves with every number of the geometry.
    moves = np.stack(
        [depth_gradient(geometry, z_mm, pixels) * (a_px_mm / z_mm**2) for z_mm in distances_mm]
    )
    of_law = _covariance_of_law(law, distances_mm, moves[:, 0], covariance)
    variance_px2 = np.einsum("kgp,pq,kgq->kg", moves, covariance, moves)
    places_px = rectification.rectified_px(geometry.reference, pixels)
    on_axis_px2 = _variance_px2(law, distances_mm, of_law)
    return Curve(
        law,
        _rows(of_law),
        _valid_mm(law, of_law, ends_mm, max_sigma_pct, source),
        0.0,
        FieldTerm(
            (float(places_px[0, 0]), float(places_px[0, 1])),
            (0.0, 0.0),
            _covariance_of_field(places_px[1:] - places_px[0], variance_px2[:, 1:], on_axis_px2),
        ),
    )


def _covariance_of_law(
    law: Physical, distances_mm: Float, moves: Float, covariance: Float
) -> Float:
    """(3, 3) of the law's parameters, from slopes on the axis (K, P) that the geometry moves."""
    seen = np.isfinite(moves).all(axis=1)
    if seen.sum() < len(law.fitted):
        raise CurveError(
            "the views of the calibration do not see the reference camera's axis together",
            advice="are two cables swapped? calibrate the rig again",
        )
    design = law.slope_gradient(law.slope_px(distances_mm[seen]))
    scale = np.linalg.norm(design, axis=0)  # mm, px mm and px differ by orders of magnitude
    by_geometry = np.linalg.lstsq(design / scale, moves[seen])[0] / scale[:, None]
    found = by_geometry @ covariance @ by_geometry.T
    return (found + found.T) / 2.0


def _covariance_of_field(
    away_px: Float, variance_px2: Float, on_axis_px2: Float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Of a slope that is linear in the pixel, by the variance that it has to add to the axis'.

    Least squares of the sum relative to the variances, so that every place and distance counts
    about alike.

    Args:
        away_px: (G, 2) from the axis.
        variance_px2: (K, G) by distance and place; NaN where no two views look.
        on_axis_px2: (K,) of the law alone.
    """
    x, y = away_px.T
    least_px2 = _LEAST * np.nanmean(variance_px2, axis=1, keepdims=True)
    weight = 1.0 / (variance_px2 + np.where(least_px2 > 0.0, least_px2, 1.0))
    forms = np.stack([x * x, 2.0 * x * y, y * y], axis=1) * weight[:, :, None]
    wanted = (weight * (variance_px2 - on_axis_px2[:, None])).ravel()
    seen = np.isfinite(wanted)
    xx, xy, yy = np.linalg.lstsq(forms.reshape(-1, 3)[seen], wanted[seen])[0].tolist()
    values, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    least = 1e-9 * max(float(values.max()), 0.0)  # rounding must not make a variance negative
    (xx, xy), (_, yy) = ((axes * np.maximum(values, least)) @ axes.T).tolist()
    return (xx, xy), (xy, yy)


def _variance_px2(law: Physical, distances_mm: Float, covariance: Float) -> Float:
    """(K,) variance of the law's slope at distances."""
    gradient = law.slope_gradient(law.slope_px(distances_mm))
    return np.einsum("kp,pq,kq->k", gradient, covariance, gradient)


def _valid_mm(
    law: Physical,
    covariance: Float,
    ends_mm: tuple[float, float],
    max_sigma_pct: float,
    source: str,
) -> tuple[float, float]:
    """Where the relative sigma of depth keeps the limit, about where it is least."""
    distances_mm = np.geomspace(*ends_mm, _FINE)
    sigma_px = np.sqrt(np.maximum(_variance_px2(law, distances_mm, covariance), 0.0))
    sigma_pct = 100.0 * sigma_px * distances_mm / law.a_px_mm
    best = int(np.argmin(sigma_pct))
    if not sigma_pct[best] < max_sigma_pct:
        raise CurveError(
            f"{source} alone knows depth to +-{2.0 * sigma_pct[best]:.2g} % at best (k=2, at "
            f"{distances_mm[best]:.0f} mm), quality.depth_sigma_pct allows "
            f"+-{2.0 * max_sigma_pct:g} %",
            advice="calibrate or sweep the rig, or raise quality.depth_sigma_pct",
        )
    return (
        _crossing_mm(distances_mm[best::-1], sigma_pct[best::-1], max_sigma_pct),
        _crossing_mm(distances_mm[best:], sigma_pct[best:], max_sigma_pct),
    )


def _crossing_mm(
    distances_mm: NDArray[np.float64], sigma_pct: NDArray[np.float64], max_sigma_pct: float
) -> float:
    """The last distance on the way from the best one that keeps the limit."""
    above = np.flatnonzero(sigma_pct > max_sigma_pct)
    if not above.size:
        return float(distances_mm[-1])
    k = int(above[0])
    share = (max_sigma_pct - sigma_pct[k - 1]) / (sigma_pct[k] - sigma_pct[k - 1])
    return float(distances_mm[k - 1] + share * (distances_mm[k] - distances_mm[k - 1]))


def _rows(matrix: Float) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())
