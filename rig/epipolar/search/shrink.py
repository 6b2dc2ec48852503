"""Smaller pictures for coarse searches, and their answers back at full size."""

from collections.abc import Iterable
from typing import TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands

Picture = TypeVar("Picture", bound=NDArray[np.integer | np.floating])


def shrink(images: Picture, factor: int) -> Picture:
    """Mean over blocks of `factor` x `factor` pixels, (V, H // factor, W // factor).

    What is left over at the right and at the bottom is cut off: blocks of whole pixels keep slopes
    exactly `factor` times smaller.
    """
    height, width = images.shape[1] // factor, images.shape[2] // factor
    small = np.empty((len(images), height, width), images.dtype)

    def work(start: int, stop: int) -> None:
        for view in range(start, stop):
            image: NDArray[np.integer | np.floating]
            image = images[view, : height * factor, : width * factor]
            for step in _steps(factor):  # halving twice is several times faster than quartering
                size = image.shape[1] // step, image.shape[0] // step
                image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
            small[view] = image

    run_in_bands(work, len(images))
    return cast("Picture", small)


def grow(values: NDArray[np.float32], factor: int, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Repeat every value over its block; the last ones also over what `shrink` cut off."""
    height, width = values.shape[0] * factor, values.shape[1] * factor
    large = cv2.resize(values, (width, height), interpolation=cv2.INTER_NEAREST)
    below, beside = shape[0] - height, shape[1] - width
    grown = cv2.copyMakeBorder(large, 0, below, 0, beside, cv2.BORDER_REPLICATE)
    return cast("NDArray[np.float32]", grown)


def _steps(factor: int) -> Iterable[int]:
    while factor % 2 == 0:
        yield 2
        factor //= 2
    if factor > 1:
        yield factor
