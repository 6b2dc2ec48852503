"""Which OAK devices are plugged in, asked of DepthAI in a process of its own, and of the kernel."""

import subprocess
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from rig.discovery import FoundDevice
from rig.errors import ConfigError, DeviceNotFoundError
from rig_drivers.permission import UDEV, why_not_permitted
from rig_drivers.usb import MOVIDIUS, UsbDevice, usb_devices

if TYPE_CHECKING:
    from rig_drivers.oak.answer import Answer, SensorAnswer

_HEAD_START = 0.95
"""Share of the time within which DepthAI has to answer, so that its silence is told as such."""


def list_oaks(timeout_s: float) -> tuple[FoundDevice, ...]:
    """Return the OAK devices of this machine and its network.

    Args:
        timeout_s: longest wait for DepthAI.

    Raises:
        ConfigError: the extra is not installed, though no OAK is on USB either.
        DeviceNotFoundError: DepthAI failed or took too long.
    """
    on_usb = [device for device in usb_devices() if device.vendor == MOVIDIUS]
    try:
        return joined(_ask(timeout_s), on_usb)
    except ConfigError as error:
        if not on_usb:
            raise
        return tuple(FoundDevice(d.place, _named(d), (), str(error)) for d in on_usb)


def joined(answers: Sequence["Answer"], on_usb: Sequence[UsbDevice]) -> tuple[FoundDevice, ...]:
    """Join what DepthAI found with what the kernel sees on USB.

    Args:
        answers: what DepthAI found.
        on_usb: devices of the vendor.
    """
    listed = [
        FoundDevice(answer.device_id, f"OAK on {answer.protocol}", (answer.name,), answer.problem)
        for answer in answers
    ]
    places = {place for oak in listed for place in oak.other_names}
    # A locked device may be there without its id: then only the kernel knows it.
    listed += [
        FoundDevice(device.place, _named(device), (), _why_hidden(device))
        for device in on_usb
        if device.place not in places
    ]
    return tuple(listed)


def _why_hidden(device: UsbDevice) -> str:
    if why_not_permitted(device.node) is not None:
        return f"may not be opened; {UDEV}"
    return "DepthAI does not show it; another program may use it: close that, or plug it in again"


def _named(device: UsbDevice) -> str:
    return f"{device.name or 'OAK'} on USB {device.vendor}:{device.product}"


def list_sensors(device: str, timeout_s: float) -> list["SensorAnswer"]:
    """Return the sensors of one device; it is booted for that.

    Args:
        device: id, address or host name.
        timeout_s: longest wait for DepthAI.

    Raises:
        ConfigError: the extra is not installed.
        DeviceNotFoundError: it is not there, is in use, or took too long.
    """
    late = DeviceNotFoundError(
        f"OAK {device}",
        f"did not tell its sensors within {timeout_s:.1f} s",
        advice="plug it in again",
    )
    text, code = _run((device,), timeout_s, late)
    from rig_drivers.oak.answer import parse_sensors  # noqa: PLC0415 - takes time to import

    return parse_sensors(text, code)


def _ask(timeout_s: float) -> list["Answer"]:
    late = DeviceNotFoundError(
        "OAK",
        f"DepthAI did not list its devices within {timeout_s:.1f} s",
        advice="its first start is slow: try again, or give it more time with --timeout-s",
    )
    text, code = _run((), timeout_s, late)
    from rig_drivers.oak.answer import parse_answer  # noqa: PLC0415 - as above

    return parse_answer(text, code)


def _run(arguments: Sequence[str], timeout_s: float, late: DeviceNotFoundError) -> tuple[str, int]:
    """Run the process that imports DepthAI; returns what it printed, and its exit code."""
    command = [sys.executable, "-P", "-m", "rig_drivers.oak", *arguments]
    deadline_s = time.monotonic() + _HEAD_START * timeout_s
    with subprocess.Popen(  # noqa: S603 - our own module
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as asked:
        import_module("rig_drivers.oak.answer")  # while DepthAI is imported, too
        try:
            text, _ = asked.communicate(timeout=max(0.0, deadline_s - time.monotonic()))
        except subprocess.TimeoutExpired as error:
            asked.kill()
            raise late from error
    return text, asked.returncode
