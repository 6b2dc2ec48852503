"""Refuses stops that contradict each other and finds the bad one among good ones."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.curve.law import Law
from rig.curve.models import nearly_physical
from rig.curve.points import CurvePoint, Stops, same_distance, stops_of
from rig.errors import CurveError

FEWEST_DISTANCES = 5
MOST_BAD = 5
"""At most every fifth stop can be bad; more than that is scatter."""
SUSPECT_SIGMA = 6.0
"""Robust sigmas; noise alone reached them in none of 4000 simulated sweeps."""
HARMLESS_PCT = 0.05
"""A stop that errs by less than this part of its distance is not worth repeating."""
NOISE_SHARE = 0.01
"""Part of the slopes' span that two stops may differ by and still be noise."""


@dataclass(frozen=True, slots=True)
class BadStop:
    """A stop that no smooth curve explains; it is left out of the fit."""

    point: CurvePoint
    miss_px: float
    """Its slope less what the stops around it predict."""
    sigmas: float
    """The miss in its robust standard deviations."""

    def __str__(self) -> str:
        return (
            f"{self.point.name} has slope {self.point.slope_px:.4f} px, {self.miss_px:+.4f} px "
            f"({abs(self.sigmas):.0f} sigma) off what the stops around it predict; it was left out "
            "of the fit: measure this distance again"
        )


def screen(points: list[CurvePoint]) -> tuple[list[CurvePoint], tuple[BadStop, ...]]:
    """Split the stops of a fit, ordered by distance, into good ones and bad ones.

    Raises:
        CurveError: fewer than five good distances, two stops of one distance that contradict
            each other, or a slope that rises with distance.
    """
    _refuse_few(points)
    _refuse_rising_sweep(points)
    bad = find_bad_stops(points)
    accused = {id(one.point) for one in bad}
    good = [point for point in points if id(point) not in accused]
    _refuse_contradictions(points, accused)
    _refuse_few(good)
    _refuse_rising_stops(good)
    return good, bad


def find_bad_stops(points: list[CurvePoint]) -> tuple[BadStop, ...]:
    """Find stops that stick out from the stops around them, the worst first.

    Local, because a law that does not suit the rig misses whole stretches, and these are not bad
    stops. The scale is the median absolute deviation, which bad stops cannot inflate (Rousseeuw and
    Leroy, Robust Regression and Outlier Detection, 1987, section 5.1). One is set apart at a time,
    since a bad stop spoils what its neighbours are compared with.
    """
    left = list(points)
    bad: list[BadStop] = []
    for _ in range(len(points) // MOST_BAD):
        stops = stops_of(left)
        if stops.distances < FEWEST_DISTANCES:
            break
        law = nearly_physical(stops)
        miss_px, spread = _local_misses(law, stops)
        robust_px = 1.4826 * float(np.median(np.abs(miss_px) / spread))
        sigmas = miss_px / spread / np.sqrt(robust_px**2 + stops.variance_px2)
        worst = int(np.argmax(np.abs(sigmas)))
        mm_per_px = float(law.depth_per_slope(law.slope_px(stops.distance_mm[[worst]]))[0])
        harmless_px = abs(HARMLESS_PCT / 100 * stops.distance_mm[worst] / mm_per_px)
        if abs(sigmas[worst]) < SUSPECT_SIGMA or abs(miss_px[worst]) < harmless_px:
            break
        bad.append(BadStop(left.pop(worst), float(miss_px[worst]), float(sigmas[worst])))
    return tuple(bad)


def _local_misses(law: Law, stops: Stops) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each stop against a straight line through the residuals of the stops around it.

    Around are the others at its own distance and at the next distance on either side, or the next
    two at an end.

    Returns:
        The misses (S,), px, and the factor (S,) by which prediction from these stops widens them.
    """
    residual_px = stops.slope_px - law.slope_px(stops.distance_mm)
    middle = np.clip(stops.group, 1, stops.distances - 2)
    around = np.abs(stops.group - middle[:, None]) <= 1
    np.fill_diagonal(around, val=False)
    miss_px = np.empty_like(residual_px)
    spread = np.empty_like(residual_px)
    for i, mask in enumerate(around):
        away_mm = stops.distance_mm[mask] - stops.distance_mm[i]
        # The value of the fitted line at the stop itself is a weighted mean of the others.
        weights = np.linalg.pinv(np.column_stack((np.ones_like(away_mm), away_mm)))[0]
        miss_px[i] = residual_px[i] - weights @ residual_px[mask]
        spread[i] = np.sqrt(1 + weights @ weights)
    return miss_px, spread


def _refuse_few(points: list[CurvePoint]) -> None:
    count = (
        np.unique(same_distance(np.array([p.distance_mm for p in points]))).size if points else 0
    )
    if count < FEWEST_DISTANCES:
        raise CurveError(
            f"found {count} usable fit distances, a curve needs {FEWEST_DISTANCES}",
            advice="sweep more distances",
        )


def _refuse_rising_sweep(points: list[CurvePoint]) -> None:
    near, far = points[0], points[-1]
    if near.slope_px <= far.slope_px:
        raise CurveError(
            f"slope rises from {near.slope_px:.4f} px at {near.distance_mm:.3f} mm to "
            f"{far.slope_px:.4f} px at {far.distance_mm:.3f} mm",
            advice="nearer must give a larger slope: "
            "check the direction of the stage and the signs of the view positions",
        )


def _refuse_rising_stops(points: list[CurvePoint]) -> None:
    stops = stops_of(points)
    visits = np.bincount(stops.group)
    mean_px = np.bincount(stops.group, stops.slope_px) / visits
    mean_mm = np.bincount(stops.group, stops.distance_mm) / visits
    variance_px2 = np.bincount(stops.group, stops.variance_px2) / visits**2
    noise_px = 4 * np.sqrt(variance_px2[:-1] + variance_px2[1:])
    rise_px = np.diff(mean_px)
    rises = rise_px > np.maximum(noise_px, NOISE_SHARE * np.ptp(mean_px))
    if rises.any():
        i = int(np.argmax(np.where(rises, rise_px, -np.inf)))
        raise CurveError(
            f"slope rises from {mean_px[i]:.4f} px at {mean_mm[i]:.3f} mm to {mean_px[i + 1]:.4f} "
            f"px at {mean_mm[i + 1]:.3f} mm",
            advice="nearer must give a larger slope: repeat these stops",
        )


def _refuse_contradictions(points: list[CurvePoint], accused: set[int]) -> None:
    """Two stops of one distance may differ by noise, or one of them must be known to be bad."""
    stops = stops_of(points)
    share_px = NOISE_SHARE * float(np.ptp(stops.slope_px))
    is_bad = np.array([id(point) in accused for point in points])
    for i, j in zip(*np.nonzero(np.triu(stops.group[:, None] == stops.group, 1)), strict=True):
        noise_px = 6 * float(np.sqrt(stops.variance_px2[i] + stops.variance_px2[j]))
        differ_px = abs(float(stops.slope_px[i] - stops.slope_px[j]))
        if is_bad[i] == is_bad[j] and differ_px > max(noise_px, share_px):
            raise CurveError(
                f"{points[i].name} has slope {points[i].slope_px:.4f} px and {points[j].name} "
                f"{points[j].slope_px:.4f} px, {differ_px:.4f} px apart where noise explains "
                f"{max(noise_px, share_px):.4f} px",
                advice="home the stage and measure this distance again",
            )
