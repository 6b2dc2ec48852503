"""Pictures written to an output node of the kernel's virtual camera: the other end of its wire."""

import contextlib
import ctypes
import fcntl
import mmap
import os
import select
from pathlib import Path
from types import TracebackType
from typing import Self

from rig_drivers.v4l2 import abi, structures

from rig.frames import GreyImage

_OUTPUT = 2
"""Buffer type of video output, `V4L2_BUF_TYPE_VIDEO_OUTPUT`."""
_BUFFERS = 2
"""One that is shown, one that takes its place."""
_TIMEOUT_S = 60.0
"""Longest wait for the line to change its picture; it has 60 chances a second."""


class VideoOutput:
    """Shows the picture that was written last, again and again, as a screen does.

    A picture is on the line when `write` returns: the driver has handed back the one before.

    Args:
        path: an output node.
        width_px: width of all pictures.
        height_px: height of all pictures.
    """

    def __init__(self, path: Path, *, width_px: int, height_px: int) -> None:
        self._path = path
        self._size = (width_px, height_px)
        self._memory: list[mmap.mmap] = []
        self._free: list[int] = []
        self._descriptor = -1
        self._is_streaming = False

    def __enter__(self) -> Self:
        self._descriptor = os.open(self._path, os.O_RDWR | os.O_NONBLOCK)
        asked = structures.Format(type=_OUTPUT)
        asked.fmt.pix.width, asked.fmt.pix.height = self._size
        asked.fmt.pix.pixelformat = abi.fourcc("GREY")
        asked.fmt.pix.field = abi.FIELD_NONE
        self._ioctl(abi.VIDIOC_S_FMT, asked)
        got = asked.fmt.pix
        assert (got.width, got.height, got.bytesperline) == (*self._size, self._size[0])
        request = structures.RequestBuffers(count=_BUFFERS, type=_OUTPUT, memory=abi.MEMORY_MMAP)
        self._ioctl(abi.VIDIOC_REQBUFS, request)
        for index in range(request.count):
            buffer = self._buffer(index)
            self._ioctl(abi.VIDIOC_QUERYBUF, buffer)
            self._memory.append(mmap.mmap(self._descriptor, buffer.length, offset=buffer.m.offset))
        self._free = list(range(request.count))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with contextlib.suppress(OSError):
            self._ioctl(abi.VIDIOC_STREAMOFF, ctypes.c_int(_OUTPUT))
        for memory in self._memory:
            memory.close()
        self._memory.clear()
        os.close(self._descriptor)
        self._is_streaming = False

    def write(self, image: GreyImage) -> None:
        """Show a picture; it is on the line when this returns.

        Raises:
            TimeoutError: the line still shows the picture before.
        """
        content = image.tobytes()
        index = self._free.pop()
        self._memory[index][0 : len(content)] = content
        buffer = self._buffer(index)
        buffer.bytesused, buffer.field = len(content), abi.FIELD_NONE
        self._ioctl(abi.VIDIOC_QBUF, buffer)
        if self._is_streaming:
            self._free.append(self._wait_for_the_one_before())
        else:
            self._ioctl(abi.VIDIOC_STREAMON, ctypes.c_int(_OUTPUT))
            self._is_streaming = True

    def _wait_for_the_one_before(self) -> int:
        """Return the buffer that is shown no more: the driver keeps only the last one."""
        poll = select.poll()
        poll.register(self._descriptor, select.POLLOUT)
        if not poll.poll(_TIMEOUT_S * 1e3):
            raise TimeoutError(f"{self._path} showed the same picture for {_TIMEOUT_S:.0f} s")
        buffer = self._buffer(0)
        self._ioctl(abi.VIDIOC_DQBUF, buffer)
        return buffer.index

    def _ioctl(self, request: int, argument: ctypes.Structure | ctypes.c_int) -> None:
        fcntl.ioctl(self._descriptor, request, argument, True)

    @staticmethod
    def _buffer(index: int) -> structures.Buffer:
        return structures.Buffer(index=index, type=_OUTPUT, memory=abi.MEMORY_MMAP)
