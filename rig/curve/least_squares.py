"""Weighted fit of a law to slopes, with the scatter between stops estimated beside it."""

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from rig.curve.law import Law
from rig.curve.points import Stops
from rig.errors import CurveError

LawT = TypeVar("LawT", bound=Law)
LawT_co = TypeVar("LawT_co", bound=Law, covariant=True)

MOST_STEPS = 200
"""Well-posed stops need five to twenty."""
ROUNDS = 50
"""Fit and scatter settle each other in three to ten rounds."""


@dataclass(frozen=True)
class FittedLaw(Generic[LawT_co]):
    """A law and how well it is known."""

    law: LawT_co
    covariance: NDArray[np.float64]
    """(P, P) of `law.fitted`."""
    scatter_px: float
    """Standard deviation between stops beyond what the samples of a stop show."""
    valid_mm: tuple[float, float]
    """Nearest and farthest distance that the law was fitted to."""


def fit_weighted(start: LawT, stops: Stops) -> FittedLaw[LawT]:
    """Fit slope as a function of distance, the errors being in the slope.

    The stage knows a distance to micrometres and the slope carries the noise, so the slope is
    regressed on distance; fitting distance on slope would bias the curve by the slopes' variance.
    Each stop weighs 1 / (variance + scatter^2), where the scatter is such that chi-square equals
    its degrees of freedom (Paule and Mandel, J. Res. Natl. Bur. Stand. 87, 377, 1982): a stop of
    tiny standard error cannot dominate.

    Args:
        start: A law near the answer.
        stops: S stops; more than the law has fitted parameters.

    Raises:
        CurveError: the stops do not determine the law.
    """
    spare = stops.slope_px.size - len(start.fitted)
    if spare < 1:
        raise CurveError(
            f"{stops.slope_px.size} stops cannot judge a law of {len(start.fitted)} parameters"
        )
    law, covariance = _refine(start, stops, stops.variance_px2)
    scatter2_px2 = 0.0
    for _ in range(ROUNDS):
        residual_px = stops.slope_px - law.slope_px(stops.distance_mm)
        before_px2 = scatter2_px2
        scatter2_px2 = excess_variance_px2(residual_px, stops.variance_px2, freedom=spare)
        if abs(scatter2_px2 - before_px2) <= 1e-4 * scatter2_px2:
            break
        law, covariance = _refine(law, stops, stops.variance_px2 + scatter2_px2)
    valid_mm = (float(stops.distance_mm[0]), float(stops.distance_mm[-1]))
    return FittedLaw(law, covariance, float(np.sqrt(scatter2_px2)), valid_mm)


def excess_variance_px2(
    residual_px: NDArray[np.float64], variance_px2: NDArray[np.float64], *, freedom: int
) -> float:
    """Variance that, added to each stop's own, makes chi-square equal `freedom` (or 0)."""
    squares = residual_px**2

    def excess(added_px2: float) -> float:
        return float(np.sum(squares / (variance_px2 + added_px2))) - freedom

    if excess(0.0) <= 0:
        return 0.0
    most_px2 = 2 * float(squares.sum()) / freedom  # halves chi-square at least
    return float(brentq(excess, 0.0, most_px2, xtol=1e-9 * most_px2, rtol=1e-9))


def _refine(
    start: LawT, stops: Stops, variance_px2: NDArray[np.float64]
) -> tuple[LawT, NDArray[np.float64]]:
    """Levenberg-Marquardt at fixed weights; returns the law and its covariance (P, P)."""
    weight = 1 / np.sqrt(variance_px2)

    def residual(values: NDArray[np.float64]) -> NDArray[np.float64]:
        law = start.with_fitted(values)
        return (law.slope_px(stops.distance_mm) - stops.slope_px) * weight

    def jacobian(values: NDArray[np.float64]) -> NDArray[np.float64]:
        law = start.with_fitted(values)
        return law.slope_gradient(law.slope_px(stops.distance_mm)) * weight[:, None]

    with np.errstate(all="ignore"):  # a step may try nonsense; the answer is checked below
        found = least_squares(
            residual, start.fitted_values(), jac=jacobian, method="lm", x_scale="jac",
            xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=MOST_STEPS,
        )  # fmt: skip
        matrix = jacobian(found.x)
    if not (np.isfinite(found.x).all() and np.isfinite(matrix).all()):
        raise CurveError(f"the {start.name} law does not settle on these stops")
    # Columns differ by many orders of magnitude (mm, px mm, px): scaled, the rank shows.
    scale = np.linalg.norm(matrix, axis=0)
    if not scale.all() or np.linalg.matrix_rank(matrix / scale, tol=1e-9) < scale.size:
        raise CurveError(f"these stops do not determine the {start.name} law")
    inverse = np.linalg.pinv(matrix / scale) / scale[:, None]
    return start.with_fitted(found.x), inverse @ inverse.T
