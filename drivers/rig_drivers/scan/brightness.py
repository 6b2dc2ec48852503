"""The brightness of the scene over a scan: measured in takes of the reference, and taken out.

The reference is looked at before, within and after the views. All takes of it show the same scene,
so what they differ by is light. Between two of them the light is taken to change evenly in time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import Frame, GreyImage
from rig_drivers.scan.kept import Kept

Grey = NDArray[np.float32]

BLOCK_PX = 16
"""Side of the squares whose means are compared: single pixels are noise, and motion is local."""
_NOT_FULL = 0.95
"""Of the full scale: blocks above have saturated pixels."""
_FEWEST = 12
"""Blocks that tell a light."""
_CONTRAST = 0.1
"""Scatter of the blocks over their mean from which an offset can be told from a gain."""
_REPEATS = 5
_HUBER = 1.5
_MAD = 1.4826
"""From the median of absolute values to the sigma of a normal distribution."""


@dataclass(frozen=True, slots=True)
class Light:
    """How a scene looks in other light: grey = gain * grey before + offset_levels."""

    gain: float = 1.0
    offset_levels: float = 0.0

    def taken_out(self, image: Grey) -> Grey:
        """Return the grey values as they were in the light before."""
        return (image - np.float32(self.offset_levels)) / np.float32(self.gain)


def relative_light(frame: Frame, against: Frame) -> Light:
    """Return the light of one picture of a scene against that of another one of it.

    A straight line through the means of blocks, by repeated least squares in which what lies off
    the line hardly counts (Huber's weights): a part that moved does not bend it. The offset is
    the black level of the sensor, which no light changes. A scene of one brightness tells no
    offset; then there is none.
    """
    here, there = block_means(frame.image), block_means(against.image)
    full = min(frame.full_scale, against.full_scale)
    usable = (there < _NOT_FULL * full) & (here < _NOT_FULL * full) & (there > 0)
    x, y = there[usable], here[usable]
    if len(x) < _FEWEST:
        return Light()
    has_contrast = float(np.std(x)) > _CONTRAST * float(np.mean(x))
    columns = np.stack([x, np.ones_like(x)], axis=1)[:, : 2 if has_contrast else 1]
    weight = np.ones_like(x)
    found = np.zeros(columns.shape[1])
    for _ in range(_REPEATS):
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(columns * root, y * root[:, 0], rcond=None)[0]
        off = np.abs(y - columns @ found)
        scale = max(_HUBER * _MAD * float(np.median(off)), 1e-9)
        weight = np.minimum(1.0, scale / np.maximum(off, 1e-12))
    return Light(float(found[0]), float(found[1]) if has_contrast else 0.0)


def block_means(image: GreyImage) -> NDArray[np.float64]:
    """Return the mean grey value of every whole block, (H // BLOCK_PX, W // BLOCK_PX)."""
    height, width = image.shape[0] // BLOCK_PX, image.shape[1] // BLOCK_PX
    whole = image[: height * BLOCK_PX, : width * BLOCK_PX]
    small = cv2.resize(whole.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float64)


def lights(takes: Sequence[Kept], reference: Kept) -> tuple[Light, ...]:
    """Return the light of every take against that of the view of the reference.

    Times of different sessions cannot be compared: in each of them the light is interpolated
    between its own takes of the reference, and held before its first and after its last one.

    Args:
        takes: of one scan.
        reference: the view of the reference, one of them.
    """
    seen = [
        (take.session, take.frame.timestamp_s, relative_light(take.frame, reference.frame))
        for take in takes
        if take.halt.view == reference.halt.view
    ]
    found: list[Light] = []
    for take in takes:
        own = [(time_s, light) for session, time_s, light in seen if session == take.session]
        if not own:  # a session that saw no reference has no view either
            found.append(Light())
            continue
        times_s, at_s = [time_s for time_s, _ in own], take.frame.timestamp_s
        gain = np.interp(at_s, times_s, [light.gain for _, light in own])
        offset = np.interp(at_s, times_s, [light.offset_levels for _, light in own])
        found.append(Light(float(gain), float(offset)))
    return tuple(found)


def in_one_light(frame: Frame, light: Light) -> GreyImage:
    """Return the image as it would be in the light of the reference; what is saturated stays so."""
    if light == Light():
        return frame.image
    levels = np.rint(light.taken_out(frame.image.astype(np.float32)))
    top = frame.full_scale
    levels[frame.image >= top] = top
    # A pixel that this light brings beyond the scale would be saturated, or black, in it.
    return cast("GreyImage", np.clip(levels, 0, top).astype(frame.image.dtype))
