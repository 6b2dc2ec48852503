"""Fits every model to a sweep and lets the distances choose."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.curve.curve import Curve
from rig.curve.holdout import HoldoutError
from rig.curve.law import ModelName
from rig.curve.linear_laws import LinearLaw, linear_laws
from rig.curve.models import MODELS
from rig.curve.points import SAME_DISTANCE_MM, CurvePoint, same_distance, stops_of
from rig.curve.residuals import Residual, residuals_of
from rig.curve.screening import BadStop, screen
from rig.errors import CurveError

ALL_MODELS: tuple[ModelName, ...] = tuple(MODELS)


@dataclass(frozen=True, slots=True)
class Candidate:
    """One model that could be fitted."""

    curve: Curve
    residuals: tuple[Residual, ...]
    """Every stop inside the curve's range, held-out and bad ones too, ordered by distance."""
    left_out: tuple[Residual, ...]
    """Each inner distance of the fit against the curve through the others."""

    @property
    def cv_rms_px(self) -> float:
        """Root mean square of `left_out`, distances weighing alike."""
        return float(np.sqrt(np.mean(self.cv_squares_px2)))

    @property
    def cv_rms_pct(self) -> float:
        """The same in per cent of distance."""
        return float(
            np.sqrt(np.mean(_per_distance(self.left_out, [r.error_pct for r in self.left_out])))
        )

    @property
    def cv_squares_px2(self) -> NDArray[np.float64]:
        """Mean square miss of each distance left out: (D - 2,)."""
        return _per_distance(self.left_out, [r.error_px for r in self.left_out])


@dataclass(frozen=True, slots=True)
class Rejected:
    """One model that could not be fitted."""

    model: ModelName
    reason: str


@dataclass(frozen=True, slots=True)
class CurveFit:
    """A fitted sweep: the chosen curve and everything it was chosen by."""

    best: Curve
    candidates: tuple[Candidate, ...]
    """The simplest first."""
    rejected: tuple[Rejected, ...]
    bad_stops: tuple[BadStop, ...]
    """Stops left out of the fit."""
    laws: tuple[LinearLaw, ...]
    """Straight lines before and after the focus distance, through the stops of the fit."""
    holdout: HoldoutError | None
    """None where no held-out stop lies inside the curve's range."""
    warnings: tuple[str, ...]
    """What a user should know, one sentence each."""


def fit_curve(
    points: Sequence[CurvePoint], *, models: Sequence[ModelName] = ALL_MODELS
) -> CurveFit:
    """Fit a depth-slope curve to the stops of a sweep.

    Bad stops are found and named first. Then every model is fitted, and fitted again with each
    distance left out, both directions of it together (Stone, J. R. Stat. Soc. B 36, 1974). The end
    distances are not left out: what lies beyond them would be extrapolation, which no curve does.
    The simplest model wins whose squared misses exceed those of the best one by no more than the
    standard error of the difference, distance by distance (one-standard-error rule; Hastie,
    Tibshirani and Friedman, The Elements of Statistical Learning, 2nd ed., section 7.10).
    Held-out stops enter none of this.

    Args:
        points: One per stop, in any order.
        models: Which models may win.

    Returns:
        The best curve, the candidates and the held-out error.

    Raises:
        CurveError: fewer than five distances to fit; slopes that rise with distance; stops of one
            distance that contradict each other or have both roles; no model fits.
    """
    ordered = sorted(points, key=lambda p: (p.distance_mm, p.direction, p.slope_px))
    held_out = [p for p in ordered if p.role == "holdout"]
    fit_points = [p for p in ordered if p.role == "fit"]
    _refuse_both_roles(ordered)
    good, bad_stops = screen(fit_points)
    candidates, rejected = [], []
    for model in sorted(set(models), key=ALL_MODELS.index):
        try:
            candidates.append(_candidate(model, good, ordered))
        except CurveError as error:
            rejected.append(Rejected(model, str(error)))
    if not candidates:
        reasons = "; ".join(f"{one.model}: {one.reason}" for one in rejected)
        raise CurveError(
            f"no model fits {len(good)} stops ({reasons})", advice="look at the slopes"
        )
    best = choose(candidates).curve
    judged = [p for p in held_out if _is_inside(p, best)]
    return CurveFit(
        best,
        tuple(candidates),
        tuple(rejected),
        bad_stops,
        linear_laws(good),
        HoldoutError.of(residuals_of(judged, best.law)) if judged else None,
        (*map(str, bad_stops), *_unjudged(held_out, best)),
    )


def choose(candidates: Sequence[Candidate]) -> Candidate:
    """Return the simplest candidate that is as good as the best within one standard error."""
    squares_px2 = [c.cv_squares_px2 for c in candidates]
    best_px2 = min(squares_px2, key=np.mean)
    # Misses of a billionth of the span are rounding: candidates that small are equal.
    rounding_px2 = (1e-9 * float(np.ptp(candidates[0].curve.domain_px))) ** 2

    def is_as_good(own_px2: NDArray[np.float64]) -> bool:
        worse_px2 = own_px2 - best_px2
        error_px2 = worse_px2.std(ddof=1) / np.sqrt(worse_px2.size)
        return bool(worse_px2.mean() <= error_px2 or own_px2.mean() <= rounding_px2)

    return next(c for c, own in zip(candidates, squares_px2, strict=True) if is_as_good(own))


def _candidate(
    model: ModelName, good: Sequence[CurvePoint], every: Sequence[CurvePoint]
) -> Candidate:
    fit = MODELS[model]
    stops = stops_of(good)
    curve = Curve.of(fit(stops))
    left_out: list[Residual] = []
    for number in range(1, stops.distances - 1):
        away = [p for p, group in zip(good, stops.group, strict=True) if group == number]
        try:
            law = fit(stops.keep(stops.group != number)).law
        except CurveError as error:
            found = f"with {away[0].distance_mm:.1f} mm left out: {error.found}"
            raise CurveError(found, advice=error.advice) from error
        left_out += residuals_of(away, law)
    inside = [p for p in every if _is_inside(p, curve)]
    return Candidate(curve, residuals_of(inside, curve.law), tuple(left_out))


def _is_inside(point: CurvePoint, curve: Curve) -> bool:
    near_mm, far_mm = curve.valid_mm
    return near_mm - SAME_DISTANCE_MM <= point.distance_mm <= far_mm + SAME_DISTANCE_MM


def _per_distance(residuals: Sequence[Residual], errors: list[float]) -> NDArray[np.float64]:
    """Mean square of the errors of each distance."""
    group = same_distance(np.array([r.point.distance_mm for r in residuals]))
    return np.bincount(group, np.square(errors)) / np.bincount(group)


def _refuse_both_roles(ordered: Sequence[CurvePoint]) -> None:
    for one, other in pairwise(ordered):
        if one.role != other.role and other.distance_mm - one.distance_mm <= SAME_DISTANCE_MM:
            raise CurveError(
                f"{one.name} and {other.name} are one distance, of which one is held out and the "
                "other fitted",
                advice="hold out all stops of a distance, or none",
            )


def _unjudged(held_out: Sequence[CurvePoint], best: Curve) -> list[str]:
    near_mm, far_mm = best.valid_mm
    return [
        f"{p.name} was held out but lies outside the fitted {near_mm:.1f}-{far_mm:.1f} mm; "
        "it judges nothing"
        for p in held_out
        if not _is_inside(p, best)
    ]
