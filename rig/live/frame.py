"""One multi-view with its depth: what a program gets."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.depth import DepthMap
from rig.epipolar import SlopeMap
from rig.errors import CalibrationError, CurveError
from rig.frames import ColourImage, GreyImage, MultiView
from rig.geometry.pinhole import Pinhole


@dataclass(frozen=True, eq=False)
class DepthFrame:
    """Depth of one instant, for every pixel of the reference view.

    Depth counts from the reference camera's optical centre along its +z. All maps are of one size;
    with a calibration that of the rectified reference view.
    """

    index: int
    """Number of the frame since the camera was opened, from 0; frames that were dropped have
    none."""
    views: MultiView
    """The pictures as the camera gave them, with times, sequence numbers and skew."""
    slopes: SlopeMap
    """What was measured: slopes, px per view step, their sigma, labels, and warnings."""
    image: GreyImage
    """(H, W) grey values of the reference view, at the pixels of the depth map."""
    time_ns: int
    """Middle of the exposure by this machine's wall clock, UTC, ns since 1970-01-01: the mean over
    the views. As sure as `views.frames[i].uncertainty_s`, and as that clock."""
    latency_s: float
    """From the middle of the exposure until the depth was ready: on the clock of the camera until
    it handed the multi-view over, then on this machine's. In simulated time the scene stands still
    while depth is made of it; that time counts all the same."""
    rig: str
    """Name of the rig."""
    depth: DepthMap | None
    """None where the camera was opened with `curve="none"`."""
    pinhole: Pinhole | None
    """See `camera`; None where nothing tells the focal length."""
    measuring_s: float = math.nan
    """How long rectifying and estimating took; the rest of `latency_s` was waiting. NaN where
    nobody measured that."""
    colour: ColourImage | None = None
    """(H, W, 3) red, green and blue of the reference view, at the pixels of the depth map; None
    where its camera gives no colour."""

    @property
    def depth_mm(self) -> NDArray[np.float32]:
        """(H, W), NaN only where the label is 0.

        Raises:
            CurveError: the camera was opened without a curve.
        """
        return self._depth.depth_mm

    @property
    def sigma_mm(self) -> NDArray[np.float32]:
        """(H, W), 1 sigma of the depth; NaN where the depth is.

        Raises:
            CurveError: the camera was opened without a curve.
        """
        return self._depth.sigma_mm

    @property
    def label(self) -> NDArray[np.uint8]:
        """(H, W): 0 no answer, 1 nearer than focus, 2 beyond focus, 3 occlusion boundary.

        Of the depth; of the slopes where the camera was opened without a curve.
        """
        return self.slopes.label if self.depth is None else self.depth.label

    @property
    def camera(self) -> Pinhole:
        """The pinhole camera that the depth map is seen by; `camera.matrix` is its (3, 3) matrix.

        By the calibration; without one by the curve, whose law of triangulation holds focal length
        times pitch, about the middle of the picture.

        Raises:
            CalibrationError: neither tells the focal length.
        """
        if self.pinhole is None:
            raise CalibrationError(
                f"asked for the camera of rig {self.rig}, which has no calibration and no curve "
                "that tells the focal length",
                advice=f"run `rig calibrate {self.rig}`",
            )
        return self.pinhole

    def points_mm(self) -> Float:
        """(H, W, 3) points in the reference camera's frame; NaN where there is no answer.

        x right, y down, z forward: z is `depth_mm`.

        Raises:
            CalibrationError: neither calibration nor curve tells the focal length.
            CurveError: the camera was opened without a curve.
        """
        return self.camera.points_mm(self.depth_mm)

    @cached_property
    def valid_share(self) -> float:
        """Share of the pixels with an answer, 0 to 1."""
        return float((self.label > 0).mean())

    @property
    def _depth(self) -> DepthMap:
        if self.depth is None:
            raise CurveError(
                f"asked for the depth of rig {self.rig}, which was opened for slopes only",
                advice='open it without curve="none", or read `slopes`',
            )
        return self.depth
