"""Depth, labels and pictures as PNG; the master of a depth is its PFM."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.errors import StoreError
from rig.files import write_bytes

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
MOST_MM = 65535


def write_depth_png(path: Path, depth_mm: NDArray[np.float32]) -> None:
    """Write depth in whole millimetres, 16 bit, 0 for no answer.

    A depth that 16 bits cannot hold is refused, not marked as no answer: 0 would say that nothing
    was measured there. Steps of 1 mm exceed the error of a good rig, so judge by the PFM.

    Args:
        path: Where; an older file of this name is replaced.
        depth_mm: (H, W), NaN for no answer.

    Raises:
        StoreError: a depth rounds to 0 mm or to more than 65535 mm, or the file cannot be written.
    """
    known = ~np.isnan(depth_mm)
    whole_mm = np.rint(depth_mm[known])
    misfits = whole_mm[(whole_mm < 1) | (whole_mm > MOST_MM)]
    if misfits.size:
        raise StoreError(
            f"{path}: {misfits.size} depths, e.g. {misfits[0]:.0f} mm, do not fit a 16-bit PNG of "
            f"1-{MOST_MM} mm",
            advice="keep them as PFM",
        )
    pixels = np.zeros(depth_mm.shape, np.uint16)
    pixels[known] = whole_mm.astype(np.uint16)
    _write_png(path, pixels)


def write_label_png(path: Path, label: NDArray[np.uint8]) -> None:
    """Write the labels (H, W) of a slope or depth map, 8 bit, as the numbers they are.

    Raises:
        StoreError: the file cannot be written.
    """
    _write_png(path, label)


def write_picture_png(path: Path, image: Pixels) -> None:
    """Write a picture as it is: (H, W) grey, or (H, W, 3) of red, green and blue.

    Raises:
        StoreError: the file cannot be written.
    """
    _write_png(path, image if image.ndim == 2 else image[..., ::-1])


def _write_png(path: Path, pixels: Pixels) -> None:
    done, encoded = cv2.imencode(".png", pixels)
    if not done:
        raise StoreError(
            f"{path}: an array {pixels.shape} of {pixels.dtype} makes no PNG",
            advice="give (H, W) or (H, W, 3) of 8 or 16 bit",
        )
    write_bytes(path, encoded.tobytes())
