"""A kernel with V4L2 cameras in it, at the seam of system calls: answers requests as drivers do."""

import ctypes
import errno
import itertools
import math
import mmap
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from rig_drivers.v4l2 import abi, structures
from rig_drivers.v4l2.kernel import FAILED, READABLE, Argument

from rig.devices import Clock

Entry = TypeVar("Entry")
Paint = Callable[[int], bytes]


@dataclass
class FakeControl:
    """A control as the driver describes it."""

    number: int
    name: str
    least: int
    most: int
    value: int
    step: int = 1
    kind: int = abi.CTRL_TYPE_INTEGER
    flags: int = 0
    menu: dict[int, str] = field(default_factory=dict[int, str])
    stored: Callable[[int], int] = int
    """What the device makes of a value: identity, or rounding, clipping ..."""
    ruled_by: tuple[int, int] | None = None
    """Number and value of the control while which this one is inactive."""


@dataclass
class FakeDevice:
    """One camera: what it offers, and what goes wrong with it."""

    card: str = "Fake camera"
    modes: tuple[tuple[str, int, int], ...] = (("GREY", 64, 48),)
    intervals: tuple[tuple[int, int], ...] = ((1, 10),)
    padding: int = 0
    """Bytes after every line."""
    controls: list[FakeControl] = field(default_factory=list[FakeControl])
    capabilities: int = abi.CAP_VIDEO_CAPTURE | abi.CAP_STREAMING
    phase_s: float = 0.0
    on_open: Callable[[], object] | None = None
    """Called while it is opened; as long as it lasts, opening lasts."""
    paint: Paint | None = None
    """Bytes of a frame by its number; by default every pixel holds the number."""
    timestamp_flags: int = abi.BUF_FLAG_TIMESTAMP_MONOTONIC
    refused: dict[int, int] = field(default_factory=dict[int, int])
    """Error number by request, for ever."""
    failing: dict[int, deque[int]] = field(default_factory=dict[int, "deque[int]"])
    """Error numbers by request, one call each."""
    damaged: set[int] = field(default_factory=set[int])
    """Numbers of frames that come with the error flag."""
    lost: set[int] = field(default_factory=set[int])
    """Numbers of frames that never come."""
    shift_s: dict[int, float] = field(default_factory=dict[int, float])
    """By number of a frame: how wrong its timestamp is."""
    first_counter: int = 0
    is_locked: bool = False
    """Whether frames end at whole multiples of the interval: as if all cameras had one trigger."""
    is_silent: bool = False
    is_plugged: bool = True
    planes: int = 1
    """Of a multi-planar node."""
    data_offset: int = 0
    """Bytes before the picture in the buffers of a multi-planar node."""

    @property
    def is_planar(self) -> bool:
        return not self.capabilities & abi.CAP_VIDEO_CAPTURE


@dataclass
class _Session:
    """A device between open and close."""

    device: FakeDevice
    mode: tuple[str, int, int]
    interval: tuple[int, int]
    memory: list[mmap.mmap] = field(default_factory=list[mmap.mmap])
    queued: deque[int] = field(default_factory=deque[int])
    done: deque[structures.Buffer] = field(default_factory=deque[structures.Buffer])
    began_s: float | None = None
    exposed: int = 0

    @property
    def interval_s(self) -> float:
        return self.interval[0] / self.interval[1]

    @property
    def stride(self) -> int:
        name, width, _ = self.mode
        return (
            width * {"GREY": 1, "NV12": 1, "MJPG": 0, "Y12I": 3}.get(name, 2) + self.device.padding
        )

    @property
    def size(self) -> int:
        name, width, height = self.mode
        if name == "MJPG":
            return width * height
        return self.stride * height * (3 if name == "NV12" else 2) // 2

    def end_s(self, number: int) -> float:
        assert self.began_s is not None
        return self.began_s + self.device.phase_s + (number + 1) * self.interval_s


class FakeVideoKernel:
    """Keeps `rig_drivers.v4l2.Kernel`; time is the clock's."""

    def __init__(self, devices: dict[str, FakeDevice], clock: Clock) -> None:
        self.devices = devices
        self.open_descriptors: set[int] = set()
        self._clock = clock
        self._sessions: dict[int, _Session] = {}
        self._descriptors = itertools.count(100)
        self._answers: dict[int, Callable[[_Session, Argument], None]] = {
            abi.VIDIOC_QUERYCAP: self._capability,
            abi.VIDIOC_ENUM_FMT: self._format_entry,
            abi.VIDIOC_ENUM_FRAMESIZES: self._size_entry,
            abi.VIDIOC_ENUM_FRAMEINTERVALS: self._interval_entry,
            abi.VIDIOC_S_FMT: self._set_format,
            abi.VIDIOC_G_PARM: self._parameters,
            abi.VIDIOC_S_PARM: self._set_parameters,
            abi.VIDIOC_QUERY_EXT_CTRL: self._control_entry,
            abi.VIDIOC_QUERYMENU: self._menu_entry,
            abi.VIDIOC_G_EXT_CTRLS: self._get_control,
            abi.VIDIOC_S_EXT_CTRLS: self._set_control,
            abi.VIDIOC_REQBUFS: self._request_buffers,
            abi.VIDIOC_QUERYBUF: self._query_buffer,
            abi.VIDIOC_QBUF: self._queue,
            abi.VIDIOC_DQBUF: self._dequeue,
            abi.VIDIOC_STREAMON: self._stream_on,
            abi.VIDIOC_STREAMOFF: self._stream_off,
        }

    def open(self, path: Path) -> int:
        device = self.devices.get(str(path))
        if device is None or not device.is_plugged:
            raise OSError(errno.ENOENT, "No such file or directory")
        if device.on_open is not None:
            device.on_open()
        if abi.VIDIOC_QUERYCAP in device.refused and device.refused[abi.VIDIOC_QUERYCAP] in (
            errno.EACCES,
            errno.EBUSY,
        ):
            raise OSError(device.refused[abi.VIDIOC_QUERYCAP], "refused")
        descriptor = next(self._descriptors)  # devices are opened in parallel
        self._sessions[descriptor] = _Session(device, device.modes[0], device.intervals[0])
        self.open_descriptors.add(descriptor)
        return descriptor

    def close(self, descriptor: int) -> None:
        self.open_descriptors.remove(descriptor)

    def ioctl(self, descriptor: int, request: int, argument: Argument) -> None:
        session = self._sessions[descriptor]
        device = session.device
        if not device.is_plugged or descriptor not in self.open_descriptors:
            raise OSError(errno.ENODEV, "No such device")
        if device.failing.get(request):
            raise OSError(device.failing[request].popleft(), "injected")
        if request in device.refused:
            raise OSError(device.refused[request], "refused")
        self._answers[request](session, argument)

    def map(self, descriptor: int, length: int, offset: int) -> mmap.mmap:
        return self._sessions[descriptor].memory[offset]

    def wait(self, descriptor: int, timeout_s: float) -> int:
        session = self._sessions[descriptor]
        until_s = self._clock.now_s() + timeout_s
        while True:
            if not session.device.is_plugged or session.device.failing.get(abi.VIDIOC_DQBUF):
                return FAILED
            self._expose(session)
            if session.done:
                return READABLE
            next_s = session.end_s(session.exposed)
            if session.device.is_silent or next_s > until_s:
                self._clock.sleep_s(until_s - self._clock.now_s())
                return 0
            self._clock.sleep_s(next_s - self._clock.now_s() + 1e-9)

    def _expose(self, session: _Session) -> None:
        """Fill buffers with all frames that have ended by now."""
        device = session.device
        if session.began_s is None or device.is_silent:
            return
        while session.end_s(session.exposed) <= self._clock.now_s():
            number = session.exposed
            session.exposed += 1
            if number in device.lost or not session.queued:
                continue
            index = session.queued.popleft()
            content = self._painted(session, number)
            session.memory[index][0 : len(content)] = content
            session.done.append(self._filled(session, index, number, len(content)))

    def _filled(self, session: _Session, index: int, number: int, used: int) -> structures.Buffer:
        device = session.device
        stamp_s = session.end_s(number) + device.shift_s.get(number, 0.0)
        whole, part = divmod(round(stamp_s * 1e6), 1_000_000)
        flags = device.timestamp_flags
        if number in device.damaged:
            flags |= abi.BUF_FLAG_ERROR
        return structures.Buffer(
            index=index,
            bytesused=used,
            flags=flags,
            length=session.size,
            sequence=(device.first_counter + number) % (1 << 32),
            timestamp=structures.TimeValue(whole, part),
        )

    @staticmethod
    def _painted(session: _Session, number: int) -> bytes:
        if session.device.paint is not None:
            return session.device.paint(number)
        return bytes([number % 256]) * session.size

    def _capability(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.Capability)
        argument.card = session.device.card.encode()
        argument.driver = b"fake"
        argument.bus_info = b"fake-bus"
        argument.capabilities = abi.CAP_DEVICE_CAPS | abi.CAP_VIDEO_CAPTURE
        argument.device_caps = session.device.capabilities

    def _format_entry(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.FormatDescription)
        names = list(dict.fromkeys(name for name, _, _ in session.device.modes))
        argument.pixelformat = abi.fourcc(_entry(names, argument.index))

    def _size_entry(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.FrameSize)
        name = abi.fourcc_name(argument.pixel_format)
        sizes = [mode[1:] for mode in session.device.modes if mode[0] == name]
        argument.type = abi.DISCRETE
        argument.size.discrete.width, argument.size.discrete.height = _entry(sizes, argument.index)

    def _interval_entry(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.FrameInterval)
        numerator, denominator = _entry(list(session.device.intervals), argument.index)
        argument.type = abi.DISCRETE
        argument.interval.discrete.numerator = numerator
        argument.interval.discrete.denominator = denominator

    def _set_format(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.Format)
        planar = session.device.is_planar
        assert argument.type == (9 if planar else 1)
        pixels = argument.fmt.pix_mp if planar else argument.fmt.pix
        asked = (abi.fourcc_name(pixels.pixelformat), pixels.width, pixels.height)
        session.mode = asked if asked in session.device.modes else session.device.modes[0]
        pixels.pixelformat = abi.fourcc(session.mode[0])
        pixels.width, pixels.height = session.mode[1:]
        memory = argument.fmt.pix_mp.plane_fmt[0] if planar else argument.fmt.pix
        memory.bytesperline, memory.sizeimage = session.stride, session.size
        if planar:
            argument.fmt.pix_mp.num_planes = session.device.planes

    def _parameters(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.StreamParameters)
        capture = argument.parm.capture
        capture.capability = abi.PARAMETER_TIME_PER_FRAME
        capture.timeperframe.numerator, capture.timeperframe.denominator = session.interval

    def _set_parameters(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.StreamParameters)
        wanted = argument.parm.capture.timeperframe
        asked = (wanted.numerator, wanted.denominator)
        if asked in session.device.intervals:
            session.interval = asked
        self._parameters(session, argument)

    def _control_entry(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.QueryExtendedControl)
        number = argument.id & 0x0FFF_FFFF
        controls = sorted(session.device.controls, key=lambda control: control.number)
        if argument.id & abi.CTRL_FLAG_NEXT:
            found = next((c for c in controls if c.number > number), None)
        else:
            found = next((c for c in controls if c.number == number), None)
        if found is None:
            raise OSError(errno.EINVAL, "no such control")
        argument.id, argument.type = found.number, found.kind
        argument.name = found.name.encode()
        argument.minimum, argument.maximum, argument.step = found.least, found.most, found.step
        argument.flags = found.flags
        if found.ruled_by is not None:
            rules = next(c for c in controls if c.number == found.ruled_by[0])
            if rules.value == found.ruled_by[1]:
                argument.flags |= abi.CTRL_FLAG_INACTIVE

    def _menu_entry(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.QueryMenu)
        menu = next(c.menu for c in session.device.controls if c.number == argument.id)
        if argument.index not in menu:
            raise OSError(errno.EINVAL, "no such entry")
        argument.name = menu[argument.index].encode()

    def _get_control(self, session: _Session, argument: Argument) -> None:
        value = _value_of(argument)
        found = next(c for c in session.device.controls if c.number == value.id)
        value.value64 = found.value & 0xFFFF_FFFF

    def _set_control(self, session: _Session, argument: Argument) -> None:
        value = _value_of(argument)
        found = next(c for c in session.device.controls if c.number == value.id)
        found.value = found.stored(value.value64)

    def _request_buffers(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.RequestBuffers)
        session.memory = [mmap.mmap(-1, max(1, session.size)) for _ in range(argument.count)]
        session.queued.clear()
        session.done.clear()

    def _query_buffer(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.Buffer)
        if session.device.is_planar:
            plane = _plane_of(argument)
            plane.length, plane.m.offset = session.size, argument.index
        else:
            argument.length, argument.m.offset = session.size, argument.index

    def _queue(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.Buffer)
        self._expose(session)
        assert argument.index not in session.queued
        session.queued.append(argument.index)

    def _dequeue(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, structures.Buffer)
        self._expose(session)
        if session.began_s is None:
            raise OSError(errno.EINVAL, "not streaming")
        if not session.done:
            raise BlockingIOError(errno.EAGAIN, "nothing yet")
        filled = session.done.popleft()
        if session.device.is_planar:
            plane = _plane_of(argument)
            plane.bytesused, plane.length = filled.bytesused, filled.length
            plane.data_offset = session.device.data_offset
            filled.m.userptr, filled.length = argument.m.userptr, 1
            filled.bytesused = 0
        ctypes.memmove(
            ctypes.addressof(argument), ctypes.addressof(filled), ctypes.sizeof(structures.Buffer)
        )

    def _stream_on(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, ctypes.c_int)
        session.began_s, session.exposed = self._clock.now_s(), 0
        if session.device.is_locked:
            ticks = math.ceil(session.began_s / session.interval_s)
            session.began_s = ticks * session.interval_s

    def _stream_off(self, session: _Session, argument: Argument) -> None:
        assert isinstance(argument, ctypes.c_int)
        session.began_s = None
        session.queued.clear()
        session.done.clear()


def grey_bytes(image: np.ndarray, padding: int) -> bytes:
    """Return the lines of an image, each followed by so many bytes that mean nothing."""
    filler = np.full((image.shape[0], padding), 0xAA, np.uint8)
    return np.hstack([image.view(np.uint8), filler]).tobytes()


def _entry(entries: list[Entry], index: int) -> Entry:
    if index >= len(entries):
        raise OSError(errno.EINVAL, "end of the list")
    return entries[index]


def _plane_of(buffer: structures.Buffer) -> structures.Plane:
    assert buffer.length == 1
    return structures.Plane.from_address(buffer.m.userptr)


def _value_of(argument: Argument) -> structures.ExtendedControl:
    assert isinstance(argument, structures.ExtendedControls)
    return structures.ExtendedControl.from_address(argument.controls)
