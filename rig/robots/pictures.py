"""Rectified pictures of every view, quickly: for people and robots, not for slopes."""

from collections.abc import Mapping
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import GreyImage
from rig.geometry.rectification import Rectification
from rig.live.frame import DepthFrame
from rig.optics.calibrated import CalibratedOptics
from rig.stored import Run


class RectifiedPictures:
    """Rectifies the views of one rig; without a calibration pictures are taken as they are.

    Linear between pixels; black where a camera does not look.

    Args:
        run: the rig.
    """

    def __init__(self, run: Run) -> None:
        self._reference = run.profile.reference
        self._maps: list[tuple[NDArray[Any], NDArray[Any]]] = []
        if isinstance(run.optics, CalibratedOptics):
            rectification = run.optics.rectification
            views = range(len(run.profile.views))
            self._maps = [_fixed_point_map(rectification, view) for view in views]

    def of(self, frame: DepthFrame) -> Mapping[str, GreyImage]:
        """Return one picture for every view, by its name; the reference is `frame.image`."""
        taken = frame.views.frames
        if not self._maps:
            return {one.view: one.image for one in taken}
        return {
            one.view: frame.image if view == self._reference else self._rectified(view, one.image)
            for view, one in enumerate(taken)
        }

    def _rectified(self, view: int, image: GreyImage) -> GreyImage:
        places, fractions = self._maps[view]
        return cast("GreyImage", cv2.remap(image, places, fractions, cv2.INTER_LINEAR))


def _fixed_point_map(rectification: Rectification, view: int) -> tuple[NDArray[Any], NDArray[Any]]:
    map_px = rectification.raw_map_px(view)
    outside = np.where(np.isfinite(map_px), map_px, -10.0).astype(np.float32)
    return cv2.convertMaps(outside[..., 0].copy(), outside[..., 1].copy(), cv2.CV_16SC2)
