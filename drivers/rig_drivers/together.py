"""Several devices opened and closed at the same time."""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Barrier
from typing import Protocol, runtime_checkable

from rig.devices import Device
from rig.errors import DeviceError, DevicesNotFoundError


@runtime_checkable
class Startable(Protocol):
    """A device that can be open before it starts, so that several start at the same moment."""

    def start(self) -> None:
        """Start; a device that has started stays as it is."""
        ...


def start_together(devices: Sequence[object]) -> None:
    """Start those devices that wait for it, at the same time; raises the first error."""
    waiting = [device for device in devices if isinstance(device, Startable)]
    if not waiting:
        return
    line = Barrier(len(waiting))

    def start(device: Startable) -> None:
        line.wait()  # threads take longer to come up than devices to start
        device.start()

    with ThreadPoolExecutor(max_workers=len(waiting)) as pool:
        starting = [pool.submit(start, device) for device in waiting]
    for future in starting:
        future.result()


def open_together(devices: Sequence[Device], *, name: str) -> None:
    """Open all devices, each in a thread of its own: it takes as long as the slowest.

    Args:
        devices: closed.
        name: names all of them together in messages.

    Raises:
        RigError: what the one device that did not open raised; all others were closed again.
        DevicesNotFoundError: several did not open.
    """
    opening: list[Future[Device]] = []
    try:
        with ThreadPoolExecutor(max_workers=max(1, len(devices))) as pool:
            opening += [pool.submit(device.__enter__) for device in devices]
    except BaseException:  # Ctrl-C while they open: wait for them, and leave none open
        _close_opened(devices, opening)
        raise
    errors = [error for future in opening if (error := future.exception()) is not None]
    if not errors:
        return
    _close_opened(devices, opening)
    by_device = [error for error in errors if isinstance(error, DeviceError)]
    if len(errors) == 1 or len(by_device) < len(errors):
        raise errors[0]
    raise DevicesNotFoundError(name, by_device, asked=len(devices))


def _close_opened(devices: Sequence[Device], opening: Sequence[Future[Device]]) -> None:
    pairs = zip(devices, opening, strict=False)
    close_together([device for device, future in pairs if future.exception() is None])


def close_together(devices: Sequence[Device]) -> None:
    """Close all devices at the same time; every one is closed, then the first error is raised."""
    with ThreadPoolExecutor(max_workers=max(1, len(devices))) as pool:
        closing = [pool.submit(device.__exit__, None, None, None) for device in devices]
    for future in closing:
        future.result()
