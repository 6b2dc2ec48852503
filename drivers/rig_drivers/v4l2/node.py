"""One open video node."""

import errno
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Self, TypeVar

from rig.devices import not_open
from rig.errors import DeviceLostError, DeviceNotFoundError
from rig_drivers.open_errors import not_opened
from rig_drivers.v4l2 import abi, structures
from rig_drivers.v4l2.kernel import Argument, Kernel, Memory

_CAPTURES = abi.CAP_VIDEO_CAPTURE | abi.CAP_VIDEO_CAPTURE_MPLANE
_GONE = (errno.ENODEV, errno.ENXIO, errno.EBADF)
_END_OF_LIST = (errno.EINVAL, errno.ENOTTY, errno.ENODATA)

_ABSENT = (
    "is not there",
    "plug it in, or correct camera.devices (`rig devices` lists them)",
)

Entry = TypeVar(
    "Entry", structures.FormatDescription, structures.FrameSize, structures.FrameInterval
)


class Node:
    """A video node between opening and closing.

    Args:
        path: a link in `/dev/v4l/by-path` or `/dev/v4l/by-id`, or the node itself. Links are
            followed at every opening, so that a camera that was plugged in again is found again.
        kernel: the system calls.
    """

    def __init__(self, path: Path, kernel: Kernel) -> None:
        self.path = path
        self.name = f"camera {path}"
        self._kernel = kernel
        self._descriptor: int | None = None
        self.capability = structures.Capability()

    def __enter__(self) -> Self:
        """Open the node.

        Raises:
            DeviceNotFoundError: it is not there, busy, forbidden, or does not stream video.
        """
        try:
            self._descriptor = self._kernel.open(self.path)
        except OSError as error:
            raise not_opened(error, self.name, what="it", absent=_ABSENT, group="video") from error
        try:
            self.capability = self._require_capture()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def buffer_type(self) -> int:
        """How its buffers are described: those of multi-planar nodes plane by plane."""
        if abilities(self.capability) & abi.CAP_VIDEO_CAPTURE:
            return abi.BUF_TYPE_VIDEO_CAPTURE
        return abi.BUF_TYPE_VIDEO_CAPTURE_MPLANE

    @property
    def is_open(self) -> bool:
        """Whether it is between opening and closing."""
        return self._descriptor is not None

    def close(self) -> None:
        """Close the node; a second time does nothing."""
        if self._descriptor is not None:
            self._kernel.close(self._descriptor)
            self._descriptor = None

    def ioctl(self, request: int, argument: Argument) -> None:
        """Carry one request out.

        Raises:
            DeviceLostError: the node is closed, or its device was unplugged.
            OSError: the driver refuses.
        """
        try:
            self._kernel.ioctl(self._opened(), request, argument)
        except OSError as error:
            if error.errno in _GONE:
                raise self.lost() from error
            raise

    def entries(self, request: int, entry: Callable[[int], Entry]) -> Iterator[Entry]:
        """Yield the entries of one of the driver's numbered lists.

        Args:
            request: what lists them.
            entry: makes the question for the entry of a number.
        """
        index = 0
        while True:
            asked = entry(index)
            try:
                self.ioctl(request, asked)
            except OSError as error:
                if error.errno in _END_OF_LIST:
                    return
                raise
            yield asked
            index += 1

    def map(self, length: int, offset: int) -> Memory:
        """See `Kernel.map`."""
        return self._kernel.map(self._opened(), length, offset)

    def wait(self, timeout_s: float) -> int:
        """See `Kernel.wait`."""
        return self._kernel.wait(self._opened(), timeout_s)

    def lost(self) -> DeviceLostError:
        """Return the error of a camera that was unplugged."""
        return DeviceLostError(
            self.name, "was unplugged or reset", advice="check cable and power, then open it again"
        )

    def _opened(self) -> int:
        if self._descriptor is None:
            raise not_open(self.name)
        return self._descriptor

    def _require_capture(self) -> structures.Capability:
        capability = structures.Capability()
        try:
            self.ioctl(abi.VIDIOC_QUERYCAP, capability)
        except OSError as error:
            raise DeviceNotFoundError(
                self.name, "is no video device", advice="name another path"
            ) from error
        able = abilities(capability)
        if able & _CAPTURES and able & abi.CAP_STREAMING:
            return capability
        card = capability.card.decode(errors="replace")
        raise DeviceNotFoundError(
            self.name,
            f"{card} does not stream pictures on this node",
            advice="`rig devices` shows others",
        )


def abilities(capability: structures.Capability) -> int:
    """Return what this very node can do; other nodes of its device may do more."""
    if capability.capabilities & abi.CAP_DEVICE_CAPS:
        return capability.device_caps
    return capability.capabilities
