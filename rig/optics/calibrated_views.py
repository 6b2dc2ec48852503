"""Pictures as the cameras gave them, with what is known about the cameras: nothing resampled."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.errors import SlopeError
from rig.frames import Pictures
from rig.geometry.rectification import Rectification


@dataclass(frozen=True, slots=True)
class CalibratedViews:
    """V raw grey pictures of one instant and the exact way into them from the common frame.

    Has what `rig.epipolar.board.fit` asks of rectified views, so that the board is measured in the
    pictures themselves.
    """

    images: Pictures
    """Raw, each of its own camera's size."""
    rectification: Rectification

    def __post_init__(self) -> None:
        cameras = self.rectification.geometry.cameras
        wanted = [(camera.width_px, camera.height_px) for camera in cameras]
        found = [(image.shape[1], image.shape[0]) for image in self.images]
        if found != wanted:
            raise SlopeError(
                f"{len(found)} pictures of {_listed(found)} px given, the calibration is of "
                f"{len(wanted)} cameras of {_listed(wanted)} px",
                advice="calibrate what is captured",
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the common frame, px."""
        return self.rectification.shape

    @property
    def x_steps(self) -> Float:
        """(V,) places of the views, in view steps."""
        return self.rectification.x_steps

    @property
    def y_steps(self) -> Float:
        """(V,)."""
        return self.rectification.y_steps

    @property
    def reference(self) -> int:
        """Index of the view at (0, 0)."""
        return self.rectification.geometry.reference

    def places_px(self, view: int, pixels: Float, slope_px: Float, beside_px: Float) -> Float:
        """Where the line of reference pixels passes through the raw picture of a view.

        Args:
            view: index.
            pixels: (2, N) of the common frame's reference view.
            slope_px: (N,) px per view step.
            beside_px: (2, N) by how much the picture lies beside the lines, in the common frame.

        Returns:
            (2, N) pixels of that picture; NaN where it does not look.
        """
        on_line = self.rectification.line_px(view, pixels, slope_px) + beside_px
        return self.rectification.raw_px(view, on_line.T).T

    def common_px(self, xy_px: Mapping[int, Float]) -> dict[int, Float]:
        """Points (..., 2) of raw pictures, by view, where straight lines would have them.

        Views before or behind the plane of the others bend the lines by a few hundredths of a
        pixel; the slope that each point's own track tells takes that out.
        """
        common = {
            view: self.rectification.rectified_px(view, xy.reshape(-1, 2)).T
            for view, xy in xy_px.items()
        }
        here = common[self.reference]
        used = list(common)
        steps = np.stack([self.x_steps[used], self.y_steps[used]], axis=1)[:, :, None]
        away = steps - steps.mean(axis=0)
        slope_px = -(away * np.stack([common[v] for v in used])).sum(axis=(0, 1)) / (away**2).sum()
        for view, step in zip(used, steps, strict=True):
            bend = self.rectification.line_px(view, here, slope_px) - (here - slope_px * step)
            common[view] = common[view] - bend
        return {view: common[view].T.reshape(xy.shape) for view, xy in xy_px.items()}


def _listed(sizes_px: Sequence[tuple[int, int]]) -> str:
    """Widths and heights, each size once, in the order of the views."""
    return ", ".join(f"{width} x {height}" for width, height in dict.fromkeys(sizes_px))
