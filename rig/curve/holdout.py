"""What the held-out distances say about depth error, and the headline made of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from rig.curve.curve import Curve
from rig.curve.depth_error import DepthError
from rig.curve.pixel_error import PixelSigma, pixel_errors
from rig.curve.points import same_distance
from rig.curve.residuals import Residual
from rig.errors import CurveError

COVERAGE = 0.9544997361036416
"""What k = 2 covers of a normal distribution."""
USUAL_MM = 1000.0
"""Where a depth error is quoted if the curve reaches so far."""


@dataclass(frozen=True, slots=True)
class HoldoutError:
    """Depth error at distances that the fit has not seen."""

    residuals: tuple[Residual, ...]
    """One per held-out stop inside the curve's range, ordered by distance."""
    bias_pct: float
    """Mean, in per cent of distance."""
    rms_pct: float
    max_pct: float
    """Largest absolute error."""
    rms_mm: float
    rms_px: float
    """Of the slope."""
    distances: int
    """How many different distances; both directions of one count once."""

    @classmethod
    def of(cls, residuals: tuple[Residual, ...]) -> "HoldoutError":
        """Summarise one residual or more, ordered by distance."""
        pct = np.array([r.error_pct for r in residuals])
        mm = np.array([r.error_mm for r in residuals])
        px = np.array([r.error_px for r in residuals])
        group = same_distance(np.array([r.point.distance_mm for r in residuals]))
        return cls(
            residuals,
            bias_pct=float(pct.mean()),
            rms_pct=float(np.sqrt(np.mean(pct**2))),
            max_pct=float(np.abs(pct).max()),
            rms_mm=float(np.sqrt(np.mean(mm**2))),
            rms_px=float(np.sqrt(np.mean(px**2))),
            distances=int(group[-1]) + 1,
        )


@dataclass(frozen=True, slots=True)
class Headline:
    """Range of validity and depth error of one calibrated rig, in one line."""

    valid_mm: tuple[float, float]
    errors: tuple[DepthError, ...]
    """Of the plane through the whole board; empty where nothing was held out: an error that nobody
    measured is not quoted."""
    distances: int
    """Held-out distances behind the errors."""
    pixels: tuple[DepthError, ...] = ()
    """Of the median pixel of a depth map, at the same distances; empty where it is unknown."""

    def __str__(self) -> str:
        near_mm, far_mm = self.valid_mm
        valid = f"valid {near_mm / 1000:.2f}-{far_mm / 1000:.2f} m"
        if not self.errors:
            return f"{valid}, depth error unknown (no held-out distance)"
        quoted = f"board plane {', '.join(map(str, self.errors))}"
        if self.pixels:
            quoted += f", one pixel (median) {', '.join(map(str, self.pixels))}"
        plural = "" if self.distances == 1 else "s"
        return f"{valid}, {quoted}, k=2 ({self.distances} held-out distance{plural})"


def depth_errors(
    curve: Curve, holdout: HoldoutError, at_mm: Sequence[float]
) -> tuple[DepthError, ...]:
    """Expanded uncertainty (k = 2) of depth at distances inside the curve's range.

    The standard uncertainty joins two parts, both as slopes, and `|dZ/dm|` carries them to depth:
    the rms miss of the held-out stops, bias included, and the sigma of the curve at that distance
    (which the held-out misses hold already once, on average over the range: the sum errs on the
    safe side where the curve is weak). The rms comes from few distances: its part is widened by
    t(distances) / 2 of Student's t at the coverage of k = 2 (JCGM 100:2008, G.3), so that 2 means
    95.45 % whether 3 distances were held out or 30.

    Raises:
        CurveError: a distance lies outside the curve's range.
    """
    distance_mm = np.asarray(at_mm, np.float64)
    slope_px = curve.slope_px(distance_mm)
    if np.isnan(slope_px).any():
        near_mm, far_mm = curve.valid_mm
        outside = ", ".join(f"{z:.1f}" for z in distance_mm[np.isnan(slope_px)])
        raise CurveError(
            f"asked for the depth error at {outside} mm, the curve is valid for "
            f"{near_mm:.1f}-{far_mm:.1f} mm",
            advice="ask inside it or sweep farther",
        )
    widening = float(stdtrit(holdout.distances, (1 + COVERAGE) / 2)) / 2
    sigma_px = np.hypot(holdout.rms_px * widening, curve.curve_sigma_px(distance_mm))
    expanded_mm = 2 * sigma_px * -curve.law.depth_per_slope(slope_px)
    return tuple(map(DepthError, distance_mm.tolist(), expanded_mm.tolist()))


def headline(
    curve: Curve,
    holdout: HoldoutError | None,
    at_mm: Sequence[float] | None = None,
    *,
    pixels: Sequence[PixelSigma] = (),
) -> Headline:
    """Make the headline.

    Args:
        curve: The curve that `holdout` judged.
        holdout: None where nothing was held out.
        at_mm: Where to quote the error; by default at 1 m, or at the far end of a curve that does
            not hold there, where the error is largest.
        pixels: How well single pixels are known, as far as the sweep measured it.

    Raises:
        CurveError: a distance asked for lies outside the curve's range.
    """
    near_mm, far_mm = curve.valid_mm
    if holdout is None:
        return Headline(curve.valid_mm, (), 0)
    if at_mm is None:
        at_mm = (USUAL_MM if near_mm <= USUAL_MM <= far_mm else far_mm,)
    errors = depth_errors(curve, holdout, at_mm)
    return Headline(curve.valid_mm, errors, holdout.distances, pixel_errors(curve, pixels, at_mm))
