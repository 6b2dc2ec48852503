"""One buffer of a stream as the kernel is asked for it, on single- and multi-planar nodes alike."""

import ctypes

from rig_drivers.v4l2 import abi, structures


class BufferRequest:
    """A buffer's description, with the one plane that multi-planar nodes describe apart.

    Args:
        buffer_type: of the node, `Node.buffer_type`.
        index: number of the buffer.
    """

    def __init__(self, buffer_type: int, index: int = 0) -> None:
        self.header = structures.Buffer(index=index, type=buffer_type, memory=abi.MEMORY_MMAP)
        self._plane: structures.Plane | None = None
        if buffer_type == abi.BUF_TYPE_VIDEO_CAPTURE_MPLANE:
            self._plane = structures.Plane()
            self.header.m.userptr = ctypes.addressof(self._plane)
            self.header.length = 1  # planes

    @property
    def length(self) -> int:
        """Size in bytes."""
        return self.header.length if self._plane is None else self._plane.length

    @property
    def offset(self) -> int:
        """Where the kernel lets it be mapped."""
        return self.header.m.offset if self._plane is None else self._plane.m.offset

    @property
    def filled(self) -> slice:
        """The bytes of the picture."""
        if self._plane is None:
            return slice(0, min(self.header.bytesused, self.header.length))
        end = min(self._plane.bytesused, self._plane.length)
        return slice(min(self._plane.data_offset, end), end)
