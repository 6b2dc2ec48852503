"""Rectified pictures of every view, quickly: for people and robots, not for slopes."""

from collections.abc import Mapping
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import ColourImage, GreyImage
from rig.geometry.rectification import Rectification
from rig.live.frame import DepthFrame
from rig.optics.calibrated import CalibratedOptics
from rig.stored import Run

_Map = NDArray[np.float32]


class RectifiedPictures:
    """Rectifies the views of one rig; without a calibration pictures are taken as they are.

    Linear between pixels; black where a camera does not look.

    Args:
        run: the rig.
    """

    def __init__(self, run: Run) -> None:
        self._reference = run.profile.reference
        self._maps: list[tuple[_Map, _Map]] = []
        if isinstance(run.optics, CalibratedOptics):
            rectification = run.optics.rectification
            views = range(len(run.profile.views))
            self._maps = [_map_of(rectification, view) for view in views]

    def of(self, frame: DepthFrame) -> Mapping[str, GreyImage]:
        """Return one picture for every view, by its name."""
        taken = frame.views.frames
        if not self._maps:
            return {one.view: one.image for one in taken}
        return {
            one.view: self._rectified(view, one.image, frame.image)
            for view, one in enumerate(taken)
        }

    def colours_of(self, frame: DepthFrame) -> Mapping[str, ColourImage]:
        """Return one picture in colour for every view that has colour, by its name."""
        found: dict[str, ColourImage] = {}
        for view, one in enumerate(frame.views.frames):
            if one.colour is not None:
                found[one.view] = self._in_colour(view, one.colour, frame.colour)
        return found

    def _in_colour(
        self, view: int, colour: ColourImage, reference: ColourImage | None
    ) -> ColourImage:
        if not self._maps:
            return colour
        columns, rows = self._maps[view]
        is_here = view == self._reference
        if is_here and reference is not None and reference.shape[:2] == columns.shape:
            return reference
        return np.asarray(cv2.remap(colour, columns, rows, cv2.INTER_LINEAR), np.uint8)

    def _rectified(self, view: int, image: GreyImage, reference: GreyImage) -> GreyImage:
        """Of the reference view there is one already, unless depth maps are smaller."""
        if view == self._reference and reference.shape == self._maps[view][0].shape:
            return reference
        columns, rows = self._maps[view]
        return cast("GreyImage", cv2.remap(image, columns, rows, cv2.INTER_LINEAR))


def _map_of(rectification: Rectification, view: int) -> tuple[_Map, _Map]:
    """Columns and rows (H, W) of the raw picture."""
    map_px = rectification.raw_map_px(view)
    outside = np.where(np.isfinite(map_px), map_px, -10.0).astype(np.float32)
    return outside[..., 0].copy(), outside[..., 1].copy()
