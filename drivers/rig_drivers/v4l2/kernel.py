"""The seam to the kernel: the five system calls that the driver makes, and no other."""

import contextlib
import ctypes
import fcntl
import mmap
import os
import select
from pathlib import Path
from typing import Final, Protocol

READABLE: Final = select.POLLIN
"""Event of `Kernel.wait`: a filled buffer can be taken."""
FAILED: Final = select.POLLERR | select.POLLHUP | select.POLLNVAL
"""Events of `Kernel.wait`: something is wrong; the next call tells what."""


Argument = ctypes.Structure | ctypes.c_int
"""What a request reads and writes."""


class Memory(Protocol):
    """A mapped buffer of a device."""

    def __getitem__(self, part: slice, /) -> bytes: ...

    def close(self) -> None:
        """Give the mapping back."""
        ...


class Kernel(Protocol):
    """What the driver asks of the operating system; every call may raise `OSError`."""

    def open(self, path: Path) -> int:
        """Open a device for reading and writing, not blocking, and return its descriptor."""
        ...

    def close(self, descriptor: int) -> None:
        """Close it; a device that is gone is closed too."""
        ...

    def ioctl(self, descriptor: int, request: int, argument: Argument) -> None:
        """Carry one request out; the answer is written into `argument`."""
        ...

    def map(self, descriptor: int, length: int, offset: int) -> Memory:
        """Map one buffer of the device into memory."""
        ...

    def wait(self, descriptor: int, timeout_s: float) -> int:
        """Return the events (`READABLE`, `FAILED`) that came within `timeout_s`, 0 for none."""
        ...


class LinuxKernel:
    """The running kernel."""

    def open(self, path: Path) -> int:
        """See `Kernel.open`."""
        return os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)

    def close(self, descriptor: int) -> None:
        """See `Kernel.close`."""
        with contextlib.suppress(OSError):
            os.close(descriptor)

    def ioctl(self, descriptor: int, request: int, argument: Argument) -> None:
        """See `Kernel.ioctl`; a call that a signal interrupted is made again."""
        while True:
            try:
                fcntl.ioctl(descriptor, request, argument, True)
            except InterruptedError:
                continue
            return

    def map(self, descriptor: int, length: int, offset: int) -> Memory:
        """See `Kernel.map`."""
        return mmap.mmap(descriptor, length, mmap.MAP_SHARED, mmap.PROT_READ, offset=offset)

    def wait(self, descriptor: int, timeout_s: float) -> int:
        """See `Kernel.wait`."""
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        events = poll.poll(max(0.0, timeout_s) * 1e3)
        return events[0][1] if events else 0
