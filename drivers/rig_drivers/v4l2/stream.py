"""The stream of buffers of an open node: mapped, numbered, recovered where that is possible."""

import contextlib
import ctypes
import errno
from collections import Counter
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from rig.devices import Clock
from rig.errors import CaptureTimeoutError, DeviceLostError
from rig_drivers.v4l2 import abi, structures
from rig_drivers.v4l2.buffers import BufferRequest
from rig_drivers.v4l2.kernel import FAILED, Memory
from rig_drivers.v4l2.node import Node

BUFFERS = 4
"""One being filled, one being read, two in reserve against a late reader."""
_WRAP = 1 << 32
_UNLIKE_SENSOR = (errno.EPIPE, errno.ENOLINK)
"""What a receiver says whose pads do not fit together (kernel's documentation of media pipelines).
"""
_MOST_RECOVERIES = 3
"""Restarts in a row without a good buffer before the camera counts as lost."""


@dataclass(frozen=True, slots=True)
class RawFrame:
    """The content of one good buffer."""

    data: NDArray[np.uint8]
    """The used bytes; they are this frame's own."""
    sequence: int
    """Frames since the stream began, lost ones included, from 0."""
    timestamp_s: float
    """When the driver says, on CLOCK_MONOTONIC."""
    is_start_of_exposure: bool
    """Whether `timestamp_s` is the start of the exposure; else the frame was complete by then."""


class CaptureStream:
    """Buffers of a node: there from `__enter__` to `__exit__`, filled from `start` on.

    Starting is one system call, so that several cameras can start at one moment.

    What cannot be used is dropped and counted in `dropped`: `damaged` (the driver set the error
    flag), `duplicate` (the same counter and time again), `lost` (the counter jumped), `timestamp`
    (not monotonic, or not of the present), `restart` (the stream was started again after an error).

    Args:
        node: open, its format set.
        clock: CLOCK_MONOTONIC.
        view: named in a timeout.
    """

    def __init__(self, node: Node, clock: Clock, view: str) -> None:
        self._node = node
        self._clock = clock
        self._view = view
        self._memory: list[Memory] = []
        self._counter: int | None = None
        self._sequence = -1
        self._last: RawFrame | None = None
        self._streaming_since_s = 0.0
        self._failures = 0
        self._is_running = False
        self.dropped: Counter[str] = Counter()

    def __enter__(self) -> Self:
        """Ask for buffers and queue them.

        Raises:
            DeviceLostError: the driver gives none.
        """
        try:
            self._allocate()
            self._queue_all()
        except BaseException as error:
            self._release()
            if isinstance(error, OSError):
                raise self._not_started(error) from error
            raise
        return self

    def start(self) -> None:
        """Start the stream; a stream that runs is left alone.

        Raises:
            DeviceLostError: the driver does not start.
        """
        if self._is_running:
            return
        try:
            self._switch_on()
        except OSError as error:
            raise self._not_started(error) from error

    def __exit__(self, *_: object) -> None:
        self._release()

    def next(self, timeout_s: float) -> RawFrame:
        """Return the next good frame, the oldest that waits.

        Raises:
            CaptureTimeoutError: no good frame within `timeout_s`.
            DeviceLostError: the camera was unplugged, or its stream cannot be restarted.
        """
        deadline_s = self._clock.now_s() + timeout_s
        before = self.dropped.copy()
        while True:
            frame = self._take()
            if frame is not None:
                return frame
            left_s = deadline_s - self._clock.now_s()
            if left_s <= 0.0:
                raise CaptureTimeoutError(
                    self._node.name,
                    missing=(self._view,),
                    timeout_s=timeout_s,
                    unusable=self.dropped - before,
                )
            if self._node.wait(left_s) & FAILED:
                self._take(has_failed=True)

    def _take(self, *, has_failed: bool = False) -> RawFrame | None:
        """Take one buffer if there is one; None if there is none or it is of no use.

        After a failure the error of this very call tells an unplugged camera from a stream that
        stopped.
        """
        buffer = BufferRequest(self._node.buffer_type)
        try:
            self._node.ioctl(abi.VIDIOC_DQBUF, buffer.header)
        except OSError as error:
            if has_failed or not isinstance(error, BlockingIOError):
                self._recover(error)
            return None
        frame = self._read(buffer)
        try:
            self._queue(buffer.header.index)
        except OSError as error:
            self._recover(error)
        return frame

    def _read(self, filled: BufferRequest) -> RawFrame | None:
        buffer = filled.header
        sequence = self._continued(buffer.sequence)
        if buffer.flags & abi.BUF_FLAG_ERROR:
            self.dropped["damaged"] += 1
            return None
        timestamp_s = buffer.timestamp.seconds + 1e-6 * buffer.timestamp.microseconds
        if not self._is_of_the_present(buffer.flags, timestamp_s):
            self.dropped["timestamp"] += 1
            return None
        last = self._last
        if last is not None and timestamp_s <= last.timestamp_s:
            self.dropped["duplicate" if timestamp_s == last.timestamp_s else "timestamp"] += 1
            return None
        frame = RawFrame(
            data=np.frombuffer(self._memory[buffer.index][filled.filled], np.uint8),
            sequence=sequence,
            timestamp_s=timestamp_s,
            is_start_of_exposure=buffer.flags & abi.BUF_FLAG_TIMESTAMP_SOURCE_MASK
            == abi.BUF_FLAG_TIMESTAMP_START_OF_EXPOSURE,
        )
        self._last = frame
        self._failures = 0
        return frame

    def _continued(self, counter: int) -> int:
        """Return the driver's 32-bit counter without its end; count what it jumped over.

        After a restart the driver counts from its beginning, and this goes on.
        """
        if self._counter is None:
            self._sequence += 1
        else:
            step = (counter - self._counter) % _WRAP
            if step >= _WRAP // 2:  # backwards: an old one again
                return self._sequence
            self.dropped["lost"] += max(0, step - 1)
            self._sequence += step
        self._counter = counter
        return self._sequence

    def _is_of_the_present(self, flags: int, timestamp_s: float) -> bool:
        if flags & abi.BUF_FLAG_TIMESTAMP_MASK != abi.BUF_FLAG_TIMESTAMP_MONOTONIC:
            return False
        return self._streaming_since_s - 1.0 <= timestamp_s <= self._clock.now_s() + 1.0

    def _recover(self, error: OSError) -> None:
        """Stop, hand all buffers back and start: the way out of a streaming error (EIO).

        Source: the kernel's documentation of VIDIOC_QBUF/DQBUF.
        """
        self._failures += 1
        if self._failures > _MOST_RECOVERIES:
            raise DeviceLostError(
                self._node.name,
                f"streaming failed {self._failures} times in a row ({error.strerror})",
                advice="check the cable and the bandwidth of its bus, then open it again",
            ) from error
        self.dropped["restart"] += 1
        try:
            self._node.ioctl(abi.VIDIOC_STREAMOFF, ctypes.c_int(self._node.buffer_type))
            self._queue_all()
            self._switch_on()
        except OSError as again:
            raise DeviceLostError(
                self._node.name,
                f"streaming failed ({error.strerror}) and cannot be restarted ({again.strerror})",
                advice="open it again",
            ) from again

    def _allocate(self) -> None:
        request = structures.RequestBuffers(
            count=BUFFERS, type=self._node.buffer_type, memory=abi.MEMORY_MMAP
        )
        self._node.ioctl(abi.VIDIOC_REQBUFS, request)
        for index in range(request.count):
            buffer = BufferRequest(self._node.buffer_type, index)
            self._node.ioctl(abi.VIDIOC_QUERYBUF, buffer.header)
            self._memory.append(self._node.map(buffer.length, buffer.offset))

    def _queue_all(self) -> None:
        for index in range(len(self._memory)):
            self._queue(index)

    def _queue(self, index: int) -> None:
        buffer = BufferRequest(self._node.buffer_type, index)
        self._node.ioctl(abi.VIDIOC_QBUF, buffer.header)

    def _switch_on(self) -> None:
        self._streaming_since_s = self._clock.now_s()
        self._counter = None
        self._node.ioctl(abi.VIDIOC_STREAMON, ctypes.c_int(self._node.buffer_type))
        self._is_running = True

    def _not_started(self, error: OSError) -> DeviceLostError:
        if error.errno in _UNLIKE_SENSOR:
            advice = (
                "sensor and receiver are set differently, or not linked: set the size and format "
                "of each with media-ctl, as the profile has them (docs/how-to/v4l2-cameras.md)"
            )
        else:
            advice = "is another program using it, or is the USB bus full?"
        return DeviceLostError(
            self._node.name, f"does not start to stream: {error.strerror}", advice=advice
        )

    def _release(self) -> None:
        """Stop and give the memory back; nothing to be done where the device is gone."""
        with contextlib.suppress(OSError, DeviceLostError):
            self._node.ioctl(abi.VIDIOC_STREAMOFF, ctypes.c_int(self._node.buffer_type))
        for memory in self._memory:
            memory.close()
        self._memory.clear()
        with contextlib.suppress(OSError, DeviceLostError):
            self._node.ioctl(
                abi.VIDIOC_REQBUFS,
                structures.RequestBuffers(
                    count=0, type=self._node.buffer_type, memory=abi.MEMORY_MMAP
                ),
            )
