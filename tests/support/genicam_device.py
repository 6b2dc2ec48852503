"""GenICam cameras in memory, at the door to the library: features as values, buffers as a list."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from rig_genicam.config import FeatureValue
from rig_genicam.door import Buffer, Offer, Packets, RefusedError
from rig_sim.clock import VirtualClock

from rig.errors import DeviceLostError, DeviceNotFoundError

Bounds = tuple[float, float, float]


def usual_features() -> dict[str, FeatureValue]:
    """A camera as another program left it."""
    return {
        "DeviceVendorName": "Rig",
        "DeviceModelName": "Memory",
        "DeviceSerialNumber": "M1",
        "Width": 640,
        "Height": 480,
        "OffsetX": 8,
        "OffsetY": 8,
        "PixelFormat": "Mono8",
        "ExposureAuto": "Continuous",
        "ExposureTime": 10000.0,
        "GainAuto": "Continuous",
        "Gain": 0.0,
        "AcquisitionFrameRateEnable": False,
        "AcquisitionFrameRate": 30.0,
        "TriggerSelector": "FrameStart",
        "TriggerMode": "On",
        "TriggerSource": "Line1",
        "TriggerActivation": "FallingEdge",
    }


@dataclass
class MemoryDevice:
    """Keeps `rig_genicam.door.GenicamDevice`."""

    clock: VirtualClock
    features: dict[str, FeatureValue] = field(default_factory=usual_features)
    limits: dict[str, Bounds] = field(
        default_factory=lambda: {
            "Width": (16.0, 640.0, 8.0),
            "Height": (16.0, 480.0, 2.0),
            "OffsetX": (0.0, 64.0, 8.0),
            "OffsetY": (0.0, 64.0, 2.0),
            "ExposureTime": (20.0, 100000.0, 0.0),
            "Gain": (0.0, 24.0, 0.0),
            "AcquisitionFrameRate": (1.0, 200.0, 0.0),
        }
    )
    lists: dict[str, Sequence[str]] = field(
        default_factory=lambda: {
            "PixelFormat": ("Mono8", "Mono12p"),
            "TriggerSelector": ("FrameStart", "AcquisitionStart"),
            "TriggerMode": ("Off", "On"),
            "TriggerSource": ("Line1", "Software"),
            "TriggerActivation": ("RisingEdge", "FallingEdge"),
            "ExposureAuto": ("Off", "Continuous"),
            "GainAuto": ("Off", "Continuous"),
        }
    )
    commands: set[str] = field(default_factory=lambda: {"TriggerSoftware"})
    stored: dict[str, Callable[[FeatureValue], FeatureValue]] = field(
        default_factory=dict[str, Callable[[FeatureValue], FeatureValue]]
    )
    """By feature: what the camera makes of a value."""
    refused: dict[str, str] = field(default_factory=dict[str, str])
    """By feature: why it cannot be written."""
    buffers: deque[Buffer] = field(default_factory=deque[Buffer])
    writes: list[tuple[str, FeatureValue]] = field(default_factory=list[tuple[str, FeatureValue]])
    fired_s: list[float] = field(default_factory=list[float])
    answer: Callable[[float], Buffer] | None = None
    """Makes the buffer of a software trigger from the time at which it came."""
    packets: Packets = field(default_factory=Packets)
    is_gone: bool = False
    is_open: bool = True
    name: str = "camera M1"

    def has(self, feature: str) -> bool:
        return feature in self.features or feature in self.commands

    def is_command(self, feature: str) -> bool:
        return feature in self.commands

    def read(self, feature: str) -> FeatureValue:
        return self.features[feature]

    def write(self, feature: str, value: FeatureValue) -> None:
        if feature in self.refused:
            raise RefusedError(self.refused[feature])
        self.writes.append((feature, value))
        if feature in self.commands:
            self.fired_s.append(self.clock.now_s())
            if self.answer is not None:
                self.buffers.append(self.answer(self.clock.now_s()))
            return
        self.features[feature] = self.stored.get(feature, lambda kept: kept)(value)

    def bounds(self, feature: str) -> Bounds | None:
        return self.limits.get(feature)

    def entries(self, feature: str) -> Sequence[str] | None:
        return self.lists.get(feature)

    def open_stream(self) -> None:
        self.writes.append(("stream", True))

    def start(self) -> None:
        self.writes.append(("start", True))

    def next(self, timeout_s: float) -> Buffer | None:
        """Time passes until the next buffer is there, or the timeout has passed."""
        self.require_there()
        end_s = self.clock.now_s() + timeout_s
        if self.buffers and self.buffers[0].arrived_s <= end_s:
            buffer = self.buffers.popleft()
            self.clock.sleep_s(max(0.0, buffer.arrived_s - self.clock.now_s()))
            return buffer
        self.clock.sleep_s(max(timeout_s, 1e-6))
        return None

    def require_there(self) -> None:
        if self.is_gone:
            raise DeviceLostError(self.name, "does not answer any more", advice="open it again")

    def close(self) -> None:
        self.is_open = False


@dataclass
class MemoryLibrary:
    """Keeps `rig_genicam.door.GenicamLibrary`."""

    devices: dict[str, MemoryDevice]

    def offers(self) -> Sequence[Offer]:
        return [Offer(serial, serial) for serial in self.devices]

    def open(self, name: str) -> MemoryDevice:
        if name not in self.devices:
            raise DeviceNotFoundError(f"camera {name}", "is not there", advice="plug it in")
        self.devices[name].is_open = True
        return self.devices[name]


def buffer(
    frame_id: int,
    arrived_s: float,
    *,
    device_ns: int = 0,
    size_px: tuple[int, int] = (32, 16),
    chunks: dict[str, float] | None = None,
    trouble: str = "",
) -> Buffer:
    """A picture, 8 bits of grey, whose every pixel is its number."""
    width_px, height_px = size_px
    data = np.full(width_px * height_px, frame_id % 256, np.uint8)
    return Buffer(
        data, width_px, height_px, 8, frame_id, device_ns, arrived_s, trouble, 0, chunks or {}
    )
