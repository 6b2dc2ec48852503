"""From a DepthAI frame to ours."""

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.errors import DeviceLostError
from rig.frames import ColourImage, GreyImage
from rig_drivers.oak.controls import Applied
from rig_drivers.oak.raw10 import packed_bytes, unpack_raw10
from rig_drivers.oak.sdk import dai

_RAW = (dai.ImgFrame.Type.RAW10, dai.ImgFrame.Type.PACK10)
_NV12 = dai.ImgFrame.Type.NV12
_GREY = (dai.ImgFrame.Type.GRAY8, dai.ImgFrame.Type.RAW8, dai.ImgFrame.Type.YUV400p)


@dataclass(frozen=True, slots=True)
class Decoded:
    """One frame of one sensor."""

    image: GreyImage
    colour: ColourImage | None
    timestamp_s: float
    """Middle of the exposure, on the host's monotonic clock."""
    sequence: int
    """Of the sensor."""
    applied: Applied
    temperature_degc: float | None
    """Of the sensor, where it has a thermometer."""


def middle_s(frame: dai.ImgFrame) -> float:
    """Return the middle of a frame's exposure on the host's monotonic clock.

    DepthAI stamps the end of an exposure and translates device time into the host's steady clock,
    which is CLOCK_MONOTONIC.
    """
    return frame.getTimestamp(dai.CameraExposureOffset.MIDDLE).total_seconds()


def start_s(frame: dai.ImgFrame) -> float:
    """Return when a frame's exposure began, on the same clock."""
    return frame.getTimestamp(dai.CameraExposureOffset.START).total_seconds()


def decode(frame: dai.ImgFrame, device: str) -> Decoded:
    """Unpack pixels and read what came with them; the pixels are a copy.

    Args:
        frame: GRAY8, RAW10 or NV12, of any stride.
        device: name of camera and view, for messages.

    Raises:
        DeviceLostError: another format, or fewer bytes than its size needs.
    """
    image, colour = _pixels(frame, device)
    return Decoded(
        image,
        colour,
        middle_s(frame),
        frame.getSequenceNum(),
        Applied.of(frame),
        frame.getSensorTemperature(),
    )


def _pixels(frame: dai.ImgFrame, device: str) -> tuple[GreyImage, ColourImage | None]:
    width, height, kind = frame.getWidth(), frame.getHeight(), frame.getType()
    # The library's stubs write the array's type in a form that numpy's own types do not know.
    data = cast("NDArray[np.uint8]", frame.getData())
    stride = frame.getStride()
    try:
        if kind in _RAW:
            padded = stride if stride >= packed_bytes(width) else None
            return unpack_raw10(data, width_px=width, height_px=height, stride=padded), None
        if kind in _GREY:
            return _grey8(data, width, height, max(stride, width)), None
        if kind == _NV12:
            return _nv12(frame, data, width, height)
    except ValueError as error:
        raise DeviceLostError(
            device, f"sent a damaged frame ({error})", advice="check the cable and open it again"
        ) from error
    raise DeviceLostError(
        device,
        f"sent pixels of type {kind.name}, GRAY8, RAW10 or NV12 was asked for",
        advice="open it again",
    )


def _grey8(data: NDArray[np.uint8], width: int, height: int, stride: int) -> GreyImage:
    needed = stride * (height - 1) + width
    if data.size < needed:
        raise ValueError(f"{width} x {height} px fill {needed} bytes, found {data.size}")
    rows = np.lib.stride_tricks.as_strided(
        data.reshape(-1), (height, width), (stride, 1), writeable=False
    )
    return np.array(rows, np.uint8)


def _nv12(
    frame: dai.ImgFrame, data: NDArray[np.uint8], width: int, height: int
) -> tuple[GreyImage, ColourImage]:
    """Luma as it is, and the colour of both planes; matrix and range as OpenCV reads NV12."""
    stride = max(frame.getStride(), width)
    grey = _grey8(data, width, height, stride)
    start = max(frame.getPlaneStride(0), stride * height)
    pairs = _grey8(data.reshape(-1)[start:], width, height // 2, stride)
    colour = cv2.cvtColor(np.concatenate([grey, pairs]), cv2.COLOR_YUV2RGB_NV12)
    return grey, np.asarray(colour, np.uint8)
