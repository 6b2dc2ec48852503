"""Sensors without a device: frames from any source, sent by host nodes into a real pipeline."""

import hashlib
from collections.abc import Mapping, Sequence
from datetime import timedelta
from typing import Protocol, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.factory import CALIBRATION_SHA256, FactoryCamera
from rig.frames import ColourImage, GreyImage
from rig_drivers.oak.guarded_node import Failures, GuardedNode
from rig_drivers.oak.raw10 import pack_raw10
from rig_drivers.oak.sdk import dai

_WAIT_S = 0.02
"""Longest wait inside a source, so that a node ends soon after it is told to."""


class SensorFrame(Protocol):
    """One frame of a source, with what its sensor would report."""

    @property
    def image(self) -> GreyImage:
        """8 bit for GRAY8 and NV12; 16 bit, 0..1023, for RAW10."""
        ...

    @property
    def colour(self) -> ColourImage | None:
        """Of NV12, which takes its hue from it and its luma from `image`; None for the others."""
        ...

    @property
    def timestamp_s(self) -> float:
        """Middle of the exposure, CLOCK_MONOTONIC."""
        ...

    @property
    def sequence(self) -> int:
        """Counter of its sensor; a gap means lost frames."""
        ...

    @property
    def exposure_s(self) -> float:
        """Exposure that was applied."""
        ...

    @property
    def iso(self) -> int:
        """Gain that was applied, as ISO value."""
        ...

    @property
    def lens_position(self) -> int:
        """Focus that was applied; -1 where there is no motor."""
        ...

    @property
    def white_balance_k(self) -> int:
        """Colour temperature that was applied, K."""
        ...

    @property
    def temperature_degc(self) -> float | None:
        """Temperature of the sensor, where it has a thermometer."""
        ...


class FrameSource(Protocol):
    """Where the frames of one sensor come from; asked by one thread of its own."""

    def next_frame(self, wait_s: float) -> SensorFrame | None:
        """Return the next frame when its exposure has ended, None if not within `wait_s`."""
        ...


class SourceRack(Protocol):
    """All sources of a camera."""

    @property
    def serial(self) -> str:
        """What tells this rack from another one."""
        ...

    @property
    def factory_calibration(self) -> Sequence[FactoryCamera] | None:
        """What a device with these sensors would hold of them; None for nothing."""
        ...

    def sources(self) -> Mapping[str, FrameSource]:
        """Return new sources by view name; their frames count from 0."""
        ...


class HostSensors:
    """Keeps `Sensors` without a device."""

    def __init__(self, rack: SourceRack) -> None:
        self._rack = rack
        self._failures = Failures()

    def __enter__(self) -> Self:
        self._failures = Failures()
        return self

    def __exit__(self, *_: object) -> None: ...

    @property
    def name(self) -> str:
        """See `Sensors.name`."""
        return f"OAK {self._rack.serial}"

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Sensors.identity`."""
        known = self._rack.factory_calibration
        told = {} if known is None else {CALIBRATION_SHA256: _sha256(known)}
        return {
            "kind": "oak",
            "model": "host nodes, no device",
            "serial": self._rack.serial,
            "depthai": dai.__version__,
            **told,
        }

    @property
    def factory_calibration(self) -> Sequence[FactoryCamera] | None:
        """See `Sensors.factory_calibration`."""
        return self._rack.factory_calibration

    def pipeline(self) -> dai.Pipeline:
        """See `Sensors.pipeline`."""
        return dai.Pipeline(createImplicitDevice=False)

    def outputs(self, pipeline: dai.Pipeline) -> dict[str, dai.Node.Output]:
        """See `Sensors.outputs`."""
        nodes = {
            view: pipeline.create(_SourceNode, view, source, self._failures)
            for view, source in self._rack.sources().items()
        }
        return {view: node.out for view, node in nodes.items()}

    def temperature_degc(self) -> float | None:
        """See `Sensors.temperature_degc`; only frames know it."""
        return None

    def failure(self) -> str | None:
        """See `Sensors.failure`."""
        return self._failures.first()


class _SourceNode(GuardedNode):
    """Sends the frames of one source."""

    def __init__(self, view: str, source: FrameSource, failures: Failures) -> None:
        super().__init__(f"the sensor of view {view}", failures)
        self.out = self.createOutput()
        self._source = source

    def step(self) -> None:
        """Send the next frame if it comes soon."""
        frame = self._source.next_frame(_WAIT_S)
        if frame is not None and self.isRunning():
            self.out.send(_message(frame))


def _message(frame: SensorFrame) -> dai.ImgFrame:
    """Return a frame as a device would send it."""
    height, width = frame.image.shape
    message = dai.ImgFrame()
    if frame.colour is not None:
        message.setType(dai.ImgFrame.Type.NV12)
        data = np.concatenate([frame.image.reshape(-1), _hue(frame.colour)]).astype(np.uint8)
        stride = width
    elif frame.image.dtype == np.uint8:
        message.setType(dai.ImgFrame.Type.GRAY8)
        data, stride = np.ascontiguousarray(frame.image).reshape(-1), width
    else:
        message.setType(dai.ImgFrame.Type.RAW10)
        data = pack_raw10(frame.image.astype(np.uint16, copy=False))
        stride = data.size // height
    message.setData(data.tobytes())
    message.setSize(width, height)
    message.setStride(stride)
    message.setSequenceNum(frame.sequence)
    message.setTimestamp(timedelta(seconds=frame.timestamp_s + frame.exposure_s / 2.0))
    message.cam.exposureTimeUs = round(frame.exposure_s * 1e6)
    message.cam.sensitivityIso = frame.iso
    message.cam.lensPosition = frame.lens_position
    message.cam.wbColorTemp = frame.white_balance_k
    message.cam.sensorTemperatureC = frame.temperature_degc
    return message


def _sha256(cameras: Sequence[FactoryCamera]) -> str:
    return hashlib.sha256(repr(tuple(cameras)).encode()).hexdigest()


def _hue(colour: ColourImage) -> NDArray[np.uint8]:
    """Return the second plane of NV12: U and V of every square of four pixels in turn."""
    height, width = colour.shape[:2]
    planes = cv2.cvtColor(colour, cv2.COLOR_RGB2YUV_I420).reshape(-1)[height * width :]
    return np.asarray(planes.reshape(2, -1).T, np.uint8).reshape(-1)
