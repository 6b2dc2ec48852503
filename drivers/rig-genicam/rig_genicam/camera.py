"""One GenICam device as a camera with one view; arrays: `rig_drivers.array.camera_array`."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Final, Self

from rig_drivers.late import LatenessRule, newest_frames
from rig_drivers.rate import RateWatch

from rig.devices import Clock, not_open
from rig.errors import CaptureTimeoutError
from rig.frames import ColourImage, Frame, GreyImage, MultiView
from rig_genicam.clock_relation import ClockRelation
from rig_genicam.config import GenicamCameraConfig
from rig_genicam.door import BUFFERS, Buffer, GenicamDevice, GenicamLibrary, Packets
from rig_genicam.frame_numbers import FrameNumbers
from rig_genicam.pixels import PixelError, layout_of, to_picture
from rig_genicam.settings import Applied, apply
from rig_genicam.software_trigger import SoftwareTrigger

_LOOK_S: Final = 0.25
"""So often a silent camera is looked at: whether it is still there."""
_SETTLES_S: Final = 0.2
"""After the start, frames only tell how the camera's clock stands: the quickest of several does."""
_TOLD: Final = (
    *("PixelFormat", "Width", "Height"),
    *("ExposureAuto", "ExposureTime", "ExposureTimeAbs", "GainAuto", "Gain", "GainRaw"),
    *("AcquisitionFrameRate", "AcquisitionFrameRateAbs"),
    *("TriggerMode", "TriggerSource", "TriggerActivation", "DeviceTemperature"),
)
"""Features whose values are kept with a run; `rig check` looks there for what is not locked."""


class GenicamCamera:
    """Gives the frames of one device; keeps `Camera`.

    Opening sets all features and reads them back. `start`, or else the first call for a frame,
    starts the pictures. Where the profile asks for software triggers, this camera fires itself at
    whole multiples of the period of `clock`, so that all cameras on one clock fire together.

    Time of a frame: when its first bytes came, evened by the camera's own clock
    (`ClockRelation`), less half of the exposure; how long the camera took from the end of the
    exposure to the first bytes is not known, at most one period, and stays as
    `Frame.uncertainty_s`. After a software trigger it is less: light was collected after it only.

    In `dropped`: `incomplete` (packets are missing), `damaged` (no picture of the size that was
    set), `lost` (the camera counted it, it never came), `duplicate` (its number came before),
    `late` (not read in time). Not counted are the frames of the first 0.2 s of a camera that tells
    times: they only show how its clock stands.

    Args:
        config: mode and features.
        view: which of the config's devices.
        library: finds and opens it.
        clock: CLOCK_MONOTONIC.
    """

    def __init__(
        self, config: GenicamCameraConfig, view: str, *, library: GenicamLibrary, clock: Clock
    ) -> None:
        self._config = config
        self._view = view
        self._library = library
        self._clock = clock
        self._name = f"camera {config.devices[view]}"
        self._told = {"kind": "genicam", "model": "", "serial": config.devices[view]}
        self._open = ExitStack()
        self._device: GenicamDevice | None = None
        self._reset()

    def _reset(self) -> None:
        self._applied = Applied(None, has_rate=True)
        self._is_running = False
        self._started_s = math.inf
        self._numbers = FrameNumbers()
        self._relation = ClockRelation()
        self._rate = RateWatch(
            self._name,
            self._config.rate_hz,
            advice="set camera.rate_hz to that, or lower camera.exposure_s or the size",
        )
        is_software = self._config.trigger is not None and self._config.trigger.is_software
        self._trigger = SoftwareTrigger(self._period_s) if is_software else None
        self._counts: Counter[str] = Counter()

    def __enter__(self) -> Self:
        """Open the device, set it up and give it buffers.

        Raises:
            DeviceNotFoundError: it is not there, or another program has it.
            ConfigError: it does not offer what the profile asks for.
            ControlError: it refuses or changes a value.
        """
        self._reset()
        with ExitStack() as opening:
            device = self._library.open(self._config.devices[self._view])
            opening.callback(device.close)
            self._applied = apply(device, self._config, self._view)
            device.open_stream()
            self._told = _told_by(device, self._config.devices[self._view])
            self._device = device
            self._open = opening.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._device = None
        self._open.close()

    def start(self) -> None:
        """Start the pictures; a camera that runs is left alone.

        Raises:
            DeviceLostError: not open, or it does not start.
        """
        self._running()

    def _running(self) -> GenicamDevice:
        device = self._device
        if device is None:
            raise not_open(self._name)
        if not self._is_running:
            self._started_s = self._clock.now_s()
            device.start()
            self._is_running = True
        return device

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`; once open also what was set, and what the network did."""
        if self._device is None:
            return self._told
        packets = self.packets
        told = f"{packets.received} received, {packets.missing} missing, {packets.resent} resent"
        return {**self._told, "packets": told} if packets.received else self._told

    @property
    def packets(self) -> Packets:
        """What the network did since opening."""
        return Packets() if self._device is None else self._device.packets

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return (self._view,)

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`; the reasons are in the docstring of the class."""
        lost = self._numbers.lost - self._counts["incomplete"] - self._counts["damaged"]
        return {**self._counts, "lost": max(0, lost)}

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        called_s = self._clock.now_s()
        while True:
            frame = self._next(called_s + timeout_s, timeout_s)
            if frame.began_s >= called_s:
                return MultiView((frame,))

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`; frames from before the call are passed over."""
        timeout_s = self._config.timeout_s
        frames = newest_frames(
            lambda deadline_s: self._next(deadline_s, timeout_s),
            self._clock,
            LatenessRule(self._period_s, waiting=BUFFERS),
            timeout_s=timeout_s,
            count_late=lambda: self._counts.update(late=1),
        )
        return (MultiView((frame,)) for frame in frames)

    def _next(self, deadline_s: float, timeout_s: float) -> Frame:
        """Return the next frame that can be used.

        Raises:
            CaptureTimeoutError: there is none until `deadline_s`.
            DeviceLostError: the camera is gone.
        """
        device = self._running()
        before = Counter(self.dropped)
        while True:
            now_s = self._clock.now_s()
            if now_s >= deadline_s:
                device.require_there()
                unusable = Counter(self.dropped) - before
                raise CaptureTimeoutError(
                    self._name, missing=(self._view,), timeout_s=timeout_s, unusable=unusable
                )
            wait_s = min(deadline_s - now_s, _LOOK_S)
            if self._trigger is not None:
                self._trigger.fire_when_due(device, now_s)
                wait_s = min(wait_s, max(0.0, self._trigger.next_s - self._clock.now_s()))
            buffer = device.next(wait_s)
            frame = None if buffer is None else self._frame(buffer)
            if frame is not None:
                return frame

    def _frame(self, buffer: Buffer) -> Frame | None:
        """Return a buffer as a frame; None, and counted, where it is none that can be used."""
        if buffer.trouble:
            self._counts["incomplete"] += 1
            return None
        sequence = self._numbers.next(int(buffer.chunks.get("FrameID", buffer.frame_id)))
        if sequence is None:
            self._counts["duplicate"] += 1
            return None
        came_s = self._came_s(buffer)
        if came_s is None:
            return None
        try:
            image, colour = self._picture(buffer)
        except PixelError:
            self._counts["damaged"] += 1
            return None
        if not self._applied.has_rate:
            self._rate.see(sequence, came_s)
        exposure_us = buffer.chunks.get("ExposureTime")
        exposure_s = self._applied.exposure_s if exposure_us is None else 1e-6 * exposure_us
        return Frame(
            view=self._view,
            image=image,
            timestamp_s=came_s - (exposure_s or 0.0) / 2.0,
            sequence=sequence,
            exposure_s=exposure_s,
            bits=layout_of(self._config.pixel_format).bits,
            uncertainty_s=self._uncertainty_s(came_s, exposure_s),
            colour=colour,
        )

    def _picture(self, buffer: Buffer) -> tuple[GreyImage, ColourImage | None]:
        config = self._config
        if (buffer.width_px, buffer.height_px) != config.size_px:
            raise PixelError(f"{buffer.width_px} x {buffer.height_px} px")
        if buffer.pixel_bits != layout_of(config.pixel_format).pixel_bits:
            raise PixelError(f"{buffer.pixel_bits} bits per pixel")
        return to_picture(
            buffer.data,
            config.pixel_format,
            width_px=config.width_px,
            height_px=config.height_px,
            padding_bytes=buffer.padding_bytes,
            colour=config.colour,
        )

    def _came_s(self, buffer: Buffer) -> float | None:
        """Return when a frame came; None as long as that is not known well."""
        device_ns = buffer.chunks.get("Timestamp", float(buffer.device_ns))
        if device_ns == 0.0:
            return buffer.arrived_s
        came_s = self._relation.arrival_s(1e-9 * device_ns, buffer.arrived_s)
        return came_s if buffer.arrived_s >= self._started_s + _SETTLES_S else None

    def _uncertainty_s(self, came_s: float, exposure_s: float | None) -> float:
        """Return how much earlier than told the exposure may have been; an unknown one too."""
        known_s = self._period_s if exposure_s is not None else 2.0 * self._period_s
        latest_s = came_s - (exposure_s or 0.0)
        fired_s = None if self._trigger is None else self._trigger.answered_s(latest_s)
        return known_s if fired_s is None else min(known_s, max(0.0, latest_s - fired_s))

    @property
    def _period_s(self) -> float:
        return 1.0 / self._config.rate_hz


def _told_by(device: GenicamDevice, asked: str) -> dict[str, str]:
    """Return what a camera says of itself and of what it was set to."""

    def read(*names: str) -> str:
        return next((str(device.read(name)) for name in names if device.has(name)), "")

    applied = [f"{name}={device.read(name)}" for name in _TOLD if device.has(name)]
    return {
        "kind": "genicam",
        "model": f"{read('DeviceVendorName')} {read('DeviceModelName')}".strip(),
        "serial": read("DeviceSerialNumber", "DeviceID") or asked,
        "firmware": read("DeviceFirmwareVersion", "DeviceVersion"),
        "controls": " ".join(applied),
    }
