"""How far one picture of a scene lies beside another one of it, to a thousandth of a pixel."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import Frame

Grey = NDArray[np.float32]

_SMOOTH_PX = 1.5
_BORDER_PX = 6


def smooth(frame: Frame) -> Grey:
    """Return a picture whose edges are wide enough for a step of a pixel."""
    image = frame.image.astype(np.float32)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), _SMOOTH_PX), np.float32)


def shift_px(picture: Grey, rest: Grey) -> tuple[float, float]:
    """Return how far a picture lies right of and below another one.

    One step of least squares over all pixels, in which brightness and black level are free as well
    (B. D. Lucas, T. Kanade, "An iterative image registration technique", IJCAI 1981): exact for
    motion well below the width of an edge.

    Args:
        picture: smooth.
        rest: smooth, of the same scene.
    """
    # The blur has nothing to take from beyond the border.
    inside = (slice(_BORDER_PX, -_BORDER_PX),) * 2
    down = np.gradient(rest, axis=0)[inside].ravel()
    across = np.gradient(rest, axis=1)[inside].ravel()
    still, change = rest[inside].ravel(), (picture - rest)[inside].ravel()
    columns = np.stack([across, down, still, np.ones_like(still)], axis=1).astype(np.float64)
    found = np.linalg.lstsq(columns.T @ columns, columns.T @ change, rcond=None)[0]
    gain = 1.0 + float(found[2])
    return -float(found[0]) / gain, -float(found[1]) / gain
