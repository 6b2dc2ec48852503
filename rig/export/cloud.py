"""The points of one frame, as formats of clouds write them."""

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.export.frame_export import times_of
from rig.live.captured import CapturedFrame

_WHERE = "x right, y down, z forward from the reference camera, mm"


@dataclass(frozen=True, eq=False, slots=True)
class Cloud:
    """A point for every pixel of a depth map, in the reference camera's frame."""

    points_mm: Float
    """(H, W, 3), NaN where there is no answer."""
    sigma_mm: NDArray[np.float32]
    """(H, W) 1 sigma of the depth."""
    label: NDArray[np.uint8] | None = None
    """(H, W) values of `Label`; None where it is unknown."""
    rgb: NDArray[np.uint8] | None = None
    """(H, W, 3): the colour picture, else the grey one; None without a picture."""
    comments: tuple[str, ...] = (_WHERE,)
    """What a person who opens the file should know: frame, unit, times."""

    @property
    def known(self) -> NDArray[np.bool_]:
        """(H, W) pixels that have a point."""
        return np.asarray(np.isfinite(self.points_mm).all(axis=-1))


def cloud_of(frame: CapturedFrame) -> Cloud:
    """Return the points of a captured frame.

    Raises:
        CalibrationError: nothing tells the focal length.
        StoreError: it has no depth, or a file is missing or damaged.
    """
    return Cloud(
        frame.points_mm(),
        frame.sigma_mm,
        frame.label,
        _rgb(frame),
        (_WHERE, json.dumps(times_of(frame))),
    )


def _rgb(frame: CapturedFrame) -> NDArray[np.uint8] | None:
    if (colour := frame.colour) is not None:
        return colour
    image = frame.image
    if image is None:
        return None
    full_scale = float(frame.facts.get("image_full_scale", np.iinfo(image.dtype).max))
    grey = np.clip(np.rint(image * (255.0 / full_scale)), 0, 255).astype(np.uint8)
    return np.stack([grey] * 3, axis=-1)
