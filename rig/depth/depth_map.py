"""From a slope map to a depth map."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.curve import Curve
from rig.epipolar import Label, SlopeMap


@dataclass(frozen=True, slots=True)
class DepthMap:
    """Depth, its standard deviation and a label for every pixel of the reference view.

    Depth is measured from the reference camera's optical centre along +z, not along the ray.
    """

    depth_mm: NDArray[np.float32]
    """(H, W), NaN only where the label is 0."""
    sigma_mm: NDArray[np.float32]
    """(H, W), 1 sigma from the slope's and the curve's; NaN where the depth is."""
    label: NDArray[np.uint8]
    """(H, W), values of `Label`; 0 also where a slope gives no depth."""


def depth_from_slopes(slopes: SlopeMap, curve: Curve, *, max_sigma_pct: float) -> DepthMap:
    """Turn every slope into a depth where the curve holds and the slope is known well enough.

    Args:
        slopes: Of one multi-view: (H, W), as on the reference camera's optical axis.
        curve: Of the same rig.
        max_sigma_pct: Largest 1 sigma of a depth, per cent of it. Above it the estimator itself
            says that the images do not tell the depth there.

    Returns:
        A map of the same size. Nothing is extrapolated: a slope outside `curve.domain_px`, or with
        a larger sigma than allowed, becomes NaN with label 0.
    """
    slope_px, sigma_px = curve.without_field(slopes.slope_px), slopes.sigma_px
    if curve.field is not None:
        height, width = slope_px.shape
        _, variance = curve.field.maps((height, width))
        sigma_px = np.sqrt(sigma_px**2 + variance)
    depth_mm = curve.depth_mm(slope_px)
    sigma_mm = curve.depth_sigma_mm(slope_px, sigma_px)
    with np.errstate(invalid="ignore"):
        known = 100.0 * sigma_mm <= max_sigma_pct * depth_mm
    depth_mm = np.where(known, depth_mm, np.nan)
    sigma_mm = np.where(known, sigma_mm, np.nan)
    label = np.where(known, slopes.label, np.uint8(Label.NONE))
    return DepthMap(depth_mm.astype(np.float32), sigma_mm.astype(np.float32), label)
