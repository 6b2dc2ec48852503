"""One V4L2 device as a camera with one view; arrays: `rig_drivers.array.camera_array`."""

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Self

from rig.devices import Clock, not_open
from rig.frames import ColourImage, Frame, GreyImage, MultiView
from rig.profile import V4l2CameraConfig
from rig_drivers.late import LatenessRule, newest_frames
from rig_drivers.rate import RateWatch
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.colour import to_colour
from rig_drivers.v4l2.controls import Controls
from rig_drivers.v4l2.formats import AppliedMode, Mode, set_mode
from rig_drivers.v4l2.kernel import Kernel
from rig_drivers.v4l2.node import Node
from rig_drivers.v4l2.pixels import DECODERS, DoubtfulPixelError, PixelError, to_grey
from rig_drivers.v4l2.settings import exposure_of, settings_for
from rig_drivers.v4l2.stream import BUFFERS, CaptureStream, RawFrame


class V4l2Camera:
    """Gives the frames of one device; keeps `Camera`.

    Opening sets mode and controls and reads them back. `start`, or else the first call for a frame,
    starts the stream; the device runs freely from then on. `grab` waits for the first frame whose
    exposure surely began after the call.

    Time of a frame: the driver tells the start of the exposure or the end of the transfer. With a
    known exposure (`exposure_s`) half of it is added or subtracted; the time of the transfer is not
    known, at most one frame interval, and stays as `Frame.uncertainty_s`.

    Args:
        config: mode and controls.
        view: which of the config's devices.
        kernel: the system calls.
        clock: CLOCK_MONOTONIC, which the kernel's timestamps count on.
    """

    def __init__(
        self, config: V4l2CameraConfig, view: str, *, kernel: Kernel, clock: Clock
    ) -> None:
        self._config = config
        self._view = view
        self._clock = clock
        self._node = Node(Path(config.devices[view]), kernel)
        self._open = ExitStack()
        self._stream: CaptureStream | None = None
        self._mode: AppliedMode | None = None
        self._exposure_s: float | None = None
        self._rate = self._rate_watch()
        self._doubtful_at: int | None = None
        self._identity: dict[str, str] = {
            "kind": "v4l2",
            "model": "",
            "serial": config.devices[view],
        }
        self._unread: Counter[str] = Counter()

    def __enter__(self) -> Self:
        """Open the device, set it up and give it buffers.

        Raises:
            DeviceNotFoundError: it is not there, or no camera.
            ConfigError: it does not offer the mode or a control, or changes a value.
            DeviceLostError: it refuses what it offers.
        """
        with ExitStack() as opening:
            opening.enter_context(self._node)
            self._mode = set_mode(self._node, self._wanted())
            controls = Controls(self._node)
            controls.apply(settings_for(self._config, self._view, controls, self._node.name))
            self._exposure_s = exposure_of(controls)
            self._rate = self._rate_watch()
            self._identity = self._identified(self._mode.mode, controls)
            stream = CaptureStream(self._node, self._clock, self._view)
            self._stream = opening.enter_context(stream)
            self._unread = Counter()
            self._open = opening.pop_all()
        return self

    def start(self) -> None:
        """Start the stream; a stream that runs is left alone.

        Raises:
            DeviceLostError: not open, or the driver does not start.
        """
        self._running()

    def _running(self) -> tuple[CaptureStream, AppliedMode]:
        if not self._node.is_open or self._stream is None or self._mode is None:
            raise not_open(self._node.name)
        self._stream.start()
        return self._stream, self._mode

    def __exit__(self, *_: object) -> None:
        self._open.close()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`; once open also mode and controls as they read back."""
        return self._identity

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return (self._view,)

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`, and `CaptureStream` for the reasons; `late`: not read in time."""
        return self._unread if self._stream is None else self._stream.dropped + self._unread

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        called_s = self._clock.now_s()
        while True:
            left_s = called_s + timeout_s - self._clock.now_s()
            frame = self._next(left_s)
            if frame is not None and frame.began_s >= called_s:
                return MultiView((frame,))

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`; frames from before the call are passed over."""
        frames = newest_frames(
            lambda deadline_s: self._next(deadline_s - self._clock.now_s()),
            self._clock,
            LatenessRule(self._interval_s, waiting=BUFFERS),
            timeout_s=self._config.timeout_s,
            count_late=lambda: self._unread.update(late=1),
        )
        return (MultiView((frame,)) for frame in frames)

    def _next(self, timeout_s: float) -> Frame | None:
        """Return the next frame; None for one that turns out to be damaged."""
        stream, mode = self._running()
        raw = stream.next(timeout_s)
        if mode.mode.rate_hz is None:
            self._rate.see(raw.sequence, raw.timestamp_s)
        image = self._image(raw, mode)
        colour = None
        if image is not None and self._config.colour:
            image, colour = self._in_colour(image, raw, mode)
        if image is None:
            stream.dropped["damaged"] += 1
            return None
        middle_s, uncertainty_s = self._middle_of_exposure(raw)
        return Frame(
            view=self._view,
            image=image,
            timestamp_s=middle_s,
            sequence=raw.sequence,
            exposure_s=self._exposure_s,
            bits=DECODERS[mode.mode.pixel_format][1],
            uncertainty_s=uncertainty_s,
            colour=colour,
        )

    def _in_colour(
        self, image: GreyImage, raw: RawFrame, mode: AppliedMode
    ) -> tuple[GreyImage | None, ColourImage | None]:
        """Return the picture with its colour, where the format has one; None where it is cut."""
        try:
            return image, to_colour(
                raw.data,
                mode.mode.pixel_format,
                width_px=mode.mode.width_px,
                height_px=mode.mode.height_px,
                bytes_per_line=mode.bytes_per_line,
            )
        except PixelError:
            return None, None

    def _image(self, raw: RawFrame, mode: AppliedMode) -> GreyImage | None:
        """Return the picture; None for a damaged one."""
        doubtful_at, self._doubtful_at = self._doubtful_at, None
        try:
            return to_grey(
                raw.data,
                mode.mode.pixel_format,
                width_px=mode.mode.width_px,
                height_px=mode.mode.height_px,
                bytes_per_line=mode.bytes_per_line,
            )
        except DoubtfulPixelError as error:
            self._doubtful_at = error.place
            # Damage does not strike twice at one place: what does is a part of the scene.
            return error.image if error.place == doubtful_at else None
        except PixelError:
            return None

    def _middle_of_exposure(self, raw: RawFrame) -> tuple[float, float]:
        half_s = (self._exposure_s or 0.0) / 2.0
        if raw.is_start_of_exposure:
            return raw.timestamp_s + half_s, 0.0
        if self._exposure_s is None:  # any exposure, then the transfer: one interval each at most
            return raw.timestamp_s, 2.0 * self._interval_s
        return raw.timestamp_s - half_s, self._interval_s

    @property
    def _interval_s(self) -> float:
        return 1.0 / self._config.rate_hz

    def _rate_watch(self) -> RateWatch:
        return RateWatch(
            self._node.name,
            self._config.rate_hz,
            advice="set camera.rate_hz to that, or the sensor to the rate (its vertical blanking: "
            "`v4l2-ctl --list-ctrls`)",
        )

    def _wanted(self) -> Mode:
        config = self._config
        return Mode(config.pixel_format, config.width_px, config.height_px, config.rate_hz)

    def _identified(self, mode: Mode, controls: Controls) -> dict[str, str]:
        capability = self._node.capability
        readable = (c for c in controls if not c.flags & abi.CTRL_FLAG_WRITE_ONLY)
        return {
            "kind": "v4l2",
            "model": capability.card.decode(errors="replace"),
            "serial": str(self._node.path),
            "bus": capability.bus_info.decode(errors="replace"),
            "driver": capability.driver.decode(errors="replace"),
            "mode": str(mode),
            "controls": " ".join(f"{c.name}={controls.read(c)}" for c in readable),
        }
