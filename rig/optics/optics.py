"""What stands between the pictures of a rig and what the estimators measure."""

from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.curve.physical import Physical
from rig.epipolar import RectifiedViews, SlopeMap
from rig.epipolar.board.lines import BoardViews
from rig.frames import Pictures
from rig.geometry.pinhole import Pinhole

Pixels = TypeVar("Pixels", bound=NDArray[Any])
"""A picture, (H, W) or (H, W, 3), that keeps its type."""


class Optics(Protocol):
    """The cameras of one rig: as its profile has them, or as a calibration found them.

    Slopes are told as if seen on the optical axis of the reference camera, which is what a
    depth-slope curve is a function of.
    """

    @property
    def calibration_id(self) -> int | None:
        """Number of the calibration; None for pictures as they are."""
        ...

    @property
    def x_steps(self) -> Float:
        """(V,) places of the views, view steps right of the reference."""
        ...

    @property
    def y_steps(self) -> Float:
        """(V,), below it."""
        ...

    def board_views(self, images: Pictures) -> BoardViews:
        """Return pictures for measuring a board: never resampled.

        Raises:
            SlopeError: the images do not fit the views or the calibration.
        """
        ...

    def views(self, images: Pictures) -> RectifiedViews:
        """Return rectified views for the dense estimator.

        Args:
            images: per view (H, W) grey, or of all (H, W, 3) in colour.

        Raises:
            SlopeError: the images do not fit the views or the calibration.
        """
        ...

    def pictures(self, images: Pictures) -> Pictures:
        """Return pictures for people, rectified and of the type that they came in."""
        ...

    def reference_picture(self, image: Pixels) -> Pixels:
        """Return the reference view's picture, grey or in colour, at the pixels of the maps.

        For people and clouds; the estimator has `views`.

        Args:
            image: (H, W) or (H, W, 3) as its camera gave it.

        Raises:
            SlopeError: it does not fit the calibration.
        """
        ...

    def answered(self, slopes: SlopeMap) -> SlopeMap:
        """Take the answer from every pixel of the reference view that shows nothing."""
        ...

    def axis_slopes_px(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Slopes (H, W) as points of the same depth have them on the reference camera's axis."""
        ...

    @property
    def axis_law(self) -> Physical | None:
        """Slope against depth on the axis by the calibration; None for pictures as they are."""
        ...

    def everywhere_px(self, axis_px: tuple[float, float]) -> tuple[float, float]:
        """Lowest and highest slope in the whole picture of a lowest and a highest on the axis."""
        ...

    def axis_plane(
        self, plane: tuple[float, float, float], centre_px: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Slope and its change per px right and down at a pixel, as seen on the axis."""
        ...

    def distance_mm(self, position_mm: float) -> float:
        """Depth of the board's centre at a position of the stage."""
        ...

    @property
    def axis_px(self) -> tuple[float, float] | None:
        """Pixel of the reference view on its optical axis; None where it is unknown."""
        ...

    @property
    def axis_variance_rad2(self) -> Float:
        """(2,) how sure the optical axis is, right and down."""
        ...

    def reference_directions(self, right_down: Float) -> Float:
        """Small vectors (2,) right and down of the common frame in the reference camera's."""
        ...

    def ray(self, pixel: tuple[float, float], focal_px: float | None) -> Float | None:
        """(2,) x / z and y / z of a pixel of the reference view, in the reference camera's frame.

        Args:
            pixel: of the reference view.
            focal_px: focal length for a rig without a calibration.

        Returns:
            None where focal length or optical axis are unknown.
        """
        ...

    def pinhole(self, size_px: tuple[int, int], focal_px: float | None) -> Pinhole | None:
        """The camera that depth maps are seen by.

        Args:
            size_px: width and height of the maps.
            focal_px: focal length for a rig without a calibration.

        Returns:
            None where the focal length is unknown.
        """
        ...
