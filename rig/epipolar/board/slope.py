"""What the line fit of a board returns."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.epipolar_error import EpipolarError


@dataclass(frozen=True, slots=True)
class BoardSlope:
    """The slope plane of one board in one multi-view: m = a + b (x - x0) + c (y - y0).

    (x0, y0) is `centre_px`: the image, in the reference view, of the middle of the board's inner
    corners (of the board itself, not the mean of the corner pixels: under perspective they differ).
    1 / Z is linear in the reference view's pixels, so the plane at that pixel is exactly the slope
    of the board's centre.
    """

    slope_px: float
    """At the centre, px per view step."""
    sigma_px: float
    """1 sigma of `slope_px`, from the residuals."""
    plane: tuple[float, float, float]
    """(a, b, c): px per view step, and its change per px along x and y; a is `slope_px`."""
    plane_covariance: Float
    """(3, 3)."""
    centre_px: tuple[float, float]
    """(x0, y0) in the reference view."""
    corner_slope_px: float
    """At the centre, from the tracks of the corners alone."""
    corner_sigma_px: float
    """1 sigma of `corner_slope_px`, from the residuals of the tracks."""
    track_residual_px: float
    """Rms distance of the corners from their lines, along both axes; shows bad rectification."""
    residual: float
    """Rms difference of the smoothed views from their common texture, grey levels."""
    edge_pixels: int
    """Pixels of the reference view that took part."""
    side_px: float
    """Median side of a square in the reference view."""
    period_px: float
    """Least change of slope, px per step, that lays the pattern onto itself in some pair."""
    epipolar: EpipolarError
    """Of the corners of all other views, from the lines of the reference view's corners."""
    corners_px: Float
    """(rows, columns, 2) in the reference view."""
    across_px: Float
    """(V, N) by how much these corners, row by row, lie across their lines in `views`."""
    outline_px: Float
    """(4, 2) polygon in the reference view within which edges belong to the board."""
    views: tuple[int, ...]
    """Indices of the views that took part."""
    gains: tuple[float, ...]
    """Contrast of each of these views relative to their mean; foreshortening changes it, too."""
    asymmetry_px: float
    """Slope of the edges' centroids less `slope_px`, where the lenses show edges with a longer tail
    on one side and the views differ in that; 0 within the noise. Both sigmas contain it."""

    def slope_at(self, x_px: Float, y_px: Float) -> Float:
        """Slope of the board's plane at pixels of the reference view."""
        a, b, c = self.plane
        return (
            a
            + b * (np.asarray(x_px) - self.centre_px[0])
            + c * (np.asarray(y_px) - self.centre_px[1])
        )
