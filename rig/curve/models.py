"""The four models: each turns stops into a fitted law, or says why it cannot."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from rig.curve.law import Law, ModelName
from rig.curve.least_squares import FittedLaw, excess_variance_px2, fit_weighted
from rig.curve.physical import Physical, PhysicalCurved
from rig.curve.points import Stops
from rig.curve.spline import Spline
from rig.curve.two_lines import TwoLines
from rig.errors import CurveError

POLE_LADDER = np.geomspace(1e-2, 1e3, 101)
"""Trial poles, in measured ranges before the nearest stop; the farthest makes a straight line."""


def fit_physical(stops: Stops) -> FittedLaw[Physical]:
    """Fit `Physical`, starting from `nearly_physical`.

    Raises:
        CurveError: no pole in front of the nearest stop explains the slopes.
    """
    start = nearly_physical(stops)
    _refuse_no_camera(start, stops)
    fitted = fit_weighted(start, stops)
    _refuse_no_camera(fitted.law, stops)
    return fitted


def nearly_physical(stops: Stops) -> Physical:
    """Return the best law of a ladder of poles, and of a finer one about its best.

    With the pole given, the physical law is linear regression of slope on inverse distance: this
    needs no start and always has an answer.
    """
    _, best = _best_pole(POLE_LADDER, stops)
    finer = POLE_LADDER[best] * np.geomspace(0.8, 1.25, 1001)
    law, _ = _best_pole(finer, stops)
    return law


def fit_physical_curved(stops: Stops) -> FittedLaw[PhysicalCurved]:
    """Fit `PhysicalCurved` from the physical law.

    Raises:
        CurveError: too few distances, or the curvature makes the law turn round.
    """
    if stops.distances < 5:
        raise CurveError(f"{stops.distances} distances cannot judge a law of 4 parameters")
    plain = fit_physical(stops).law
    ends_px = plain.slope_px(stops.distance_mm[[-1, 0]])
    start = PhysicalCurved(
        **plain.params(), curvature_px=0.0, low_px=float(ends_px[0]), high_px=float(ends_px[1])
    )
    fitted = fit_weighted(start, stops)
    law = fitted.law
    if np.any(law.correction_rate(np.linspace(law.low_px, law.high_px, 101)) <= 0):
        raise CurveError(
            f"a curvature of {law.curvature_px:.3f} px over slopes {law.low_px:.3f}.."
            f"{law.high_px:.3f} px makes the law turn round"
        )
    return fitted


def fit_two_lines(stops: Stops) -> FittedLaw[TwoLines]:
    """Fit `TwoLines`, starting from straight lines through either side.

    Raises:
        CurveError: fewer than two distances before or after the focus distance.
    """
    before = stops.slope_px > 0
    for side, mask in (("before", before), ("after", ~before)):
        count = np.unique(stops.group[mask]).size
        if count < 2:
            raise CurveError(
                f"{count} distance{'' if count == 1 else 's'} {side} the focus distance",
                advice="a line on either side needs 2",
            )
    focus_mm = float(np.interp(0.0, stops.slope_px[::-1], stops.distance_mm[::-1]))
    away_mm = stops.distance_mm - focus_mm
    rates = [
        float(away_mm[m] @ stops.slope_px[m] / (away_mm[m] @ away_mm[m])) for m in (before, ~before)
    ]
    fitted = fit_weighted(TwoLines(focus_mm, *rates), stops)
    law = fitted.law
    if max(law.before_px_per_mm, law.after_px_per_mm) >= 0:
        raise CurveError(
            f"{law.before_px_per_mm:.4f} px per mm before and {law.after_px_per_mm:.4f} px per mm "
            "after the focus distance",
            advice="both must fall",
        )
    return fitted


def fit_spline(stops: Stops) -> FittedLaw[Spline]:
    """Draw `Spline` through the averaged distances.

    A spline leaves no residuals, so its scatter between stops is what leave-one-distance-out
    misses show. These hold the gap's interpolation error too: the scatter is an upper estimate.

    Raises:
        CurveError: fewer than four distances with falling slopes remain after averaging.
    """
    misses_px = [
        stops.slope_px[stops.group == left_out]
        - _spline(stops.keep(stops.group != left_out), 0.0)[0].slope_px(
            stops.distance_mm[stops.group == left_out]
        )
        for left_out in range(1, stops.distances - 1)
    ]
    inner = (stops.group > 0) & (stops.group < stops.distances - 1)
    scatter2_px2 = excess_variance_px2(
        np.concatenate(misses_px), stops.variance_px2[inner], freedom=int(inner.sum())
    )
    law, variance_px2 = _spline(stops, scatter2_px2)
    valid_mm = (law.knots_mm[0], law.knots_mm[-1])
    return FittedLaw(law, np.diag(variance_px2), float(np.sqrt(scatter2_px2)), valid_mm)


MODELS: Mapping[ModelName, Callable[[Stops], FittedLaw[Law]]] = MappingProxyType(
    {
        "physical": fit_physical,
        "two-lines": fit_two_lines,
        "physical-curved": fit_physical_curved,
        "spline": fit_spline,
    }
)
"""Every model, the simplest first."""


def _best_pole(ladder: NDArray[np.float64], stops: Stops) -> tuple[Physical, int]:
    """The law of the rung (R,) that misses the stops least, and which rung that is."""
    near_mm, far_mm = stops.distance_mm[0], stops.distance_mm[-1]
    z0_mm = near_mm - (far_mm - near_mm) * ladder
    weight = 1 / stops.variance_px2
    weight /= weight.sum()
    inverse = 1 / (stops.distance_mm - z0_mm[:, None])
    mean_inverse, mean_px = inverse @ weight, float(weight @ stops.slope_px)
    away, away_px = inverse - mean_inverse[:, None], stops.slope_px - mean_px
    a_px_mm = (away @ (weight * away_px)) / (away**2 @ weight)
    miss_px = away_px - a_px_mm[:, None] * away
    best = int(np.argmin(miss_px**2 @ weight))
    m_inf_px = mean_px - a_px_mm[best] * mean_inverse[best]
    return Physical(float(z0_mm[best]), float(a_px_mm[best]), float(m_inf_px)), best


def _refuse_no_camera(law: Physical, stops: Stops) -> None:
    near_mm, far_mm = stops.distance_mm[0], stops.distance_mm[-1]
    farthest_mm = near_mm - 0.9 * POLE_LADDER[-1] * (far_mm - near_mm)
    if not farthest_mm < law.z0_mm < near_mm or law.a_px_mm <= 0:
        raise CurveError(
            f"z0 = {law.z0_mm:.1f} mm and a = {law.a_px_mm:.1f} px mm are no camera that sees "
            f"{near_mm:.1f}-{far_mm:.1f} mm: the slopes do not fall like 1 / distance"
        )


def _spline(stops: Stops, scatter2_px2: float) -> tuple[Spline, NDArray[np.float64]]:
    """Spline and the variance of its knots (K,); neighbours in false order become one knot."""
    weight = 1 / (stops.variance_px2 + scatter2_px2)
    total = np.bincount(stops.group, weight)
    mean_mm = np.bincount(stops.group, weight * stops.distance_mm) / total
    mean_px = np.bincount(stops.group, weight * stops.slope_px) / total
    falling = isotonic_regression(mean_px, weights=total, increasing=False)
    block = np.repeat(np.arange(falling.blocks.size - 1), np.diff(falling.blocks))
    knot = np.bincount(block, total)
    if knot.size < 4:
        raise CurveError(f"{knot.size} distances with falling slopes", advice="a spline needs 4")
    knots_mm = np.bincount(block, total * mean_mm) / knot
    knots_px = np.bincount(block, total * mean_px) / knot
    return Spline(tuple(knots_mm.tolist()), tuple(knots_px.tolist())), 1 / knot
