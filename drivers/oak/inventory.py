"""Which OAK devices are plugged in, asked of DepthAI in a process of its own, and of the kernel."""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from pydantic import TypeAdapter, ValidationError

from drivers.permission import why_not_permitted
from drivers.usb import MOVIDIUS, UsbDevice, usb_devices
from rig.errors import ConfigError, DeviceNotFoundError
from rig.profile.model import Model

_HEAD_START = 0.95
"""Share of the time within which DepthAI has to answer, so that its silence is told as such."""
_RULES = "docs/how-to/udev/80-oak.rules"


class Answer(Model):
    """One device as `python -m drivers.oak` prints it; see `FoundOak`."""

    device_id: str
    name: str
    protocol: str
    problem: str | None


class Failure(Model):
    """What it prints instead of a list."""

    error: str
    installed: bool


_ANSWER: TypeAdapter[list[Answer] | Failure] = TypeAdapter(list[Answer] | Failure)


@dataclass(frozen=True, slots=True)
class ListedOak:
    """One OAK device, whether it can be used or not."""

    name: str
    """Device id, what `camera.device` takes; USB place where only the kernel sees it."""
    description: str
    other_names: tuple[str, ...] = ()
    problem: str | None = None


def list_oaks(timeout_s: float) -> tuple[ListedOak, ...]:
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
        return tuple(ListedOak(d.place, _named(d), (), str(error)) for d in on_usb)


def joined(answers: Sequence[Answer], on_usb: Sequence[UsbDevice]) -> tuple[ListedOak, ...]:
    """Join what DepthAI found with what the kernel sees on USB.

    Args:
        answers: what DepthAI found.
        on_usb: devices of the vendor.
    """
    listed = [
        ListedOak(answer.device_id, f"OAK on {answer.protocol}", (answer.name,), answer.problem)
        for answer in answers
    ]
    places = {place for oak in listed for place in oak.other_names}
    # A locked device may be there without its id: then only the kernel knows it.
    listed += [
        ListedOak(device.place, _named(device), (), _why_hidden(device))
        for device in on_usb
        if device.place not in places
    ]
    return tuple(listed)


def _why_hidden(device: UsbDevice) -> str:
    if why_not_permitted(device.node) is not None:
        return f"may not be opened; install {_RULES} and plug it in again"
    return "DepthAI does not show it; another program may use it: close that, or plug it in again"


def _named(device: UsbDevice) -> str:
    return f"{device.name or 'OAK'} on USB {device.vendor}:{device.product}"


def _ask(timeout_s: float) -> list[Answer]:
    command = [sys.executable, "-P", "-m", "drivers.oak"]
    try:
        done = subprocess.run(  # noqa: S603 - our own module
            command,
            capture_output=True,
            text=True,
            timeout=_HEAD_START * timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise DeviceNotFoundError(
            "OAK",
            f"DepthAI did not list its devices within {timeout_s:.1f} s; its first start is slow: "
            "try again, or give it more time with --timeout-s",
        ) from error
    return parse_answer(done.stdout, done.returncode)


def parse_answer(text: str, code: int) -> list[Answer]:
    """Return the devices in the last line that `python -m drivers.oak` printed.

    Raises:
        ConfigError: the extra is not installed.
        DeviceNotFoundError: the search failed.
    """
    lines = text.strip().splitlines()
    try:
        answer = _ANSWER.validate_json(lines[-1] if lines else "")
    except ValidationError as error:
        raise DeviceNotFoundError(
            "OAK", f"DepthAI ended with code {code} and no list of devices; try again"
        ) from error
    if not isinstance(answer, Failure):
        return answer
    if not answer.installed:
        raise ConfigError(answer.error)
    raise DeviceNotFoundError("OAK", answer.error)
