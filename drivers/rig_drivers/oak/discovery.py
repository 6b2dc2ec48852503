"""Which OAK devices there are, and which one a profile means."""

import ipaddress
import socket
import string
from collections.abc import Sequence
from dataclasses import dataclass

from rig.errors import DeviceNotFoundError
from rig_drivers.oak.sdk import dai
from rig_drivers.permission import UDEV

_LOCKED = dai.XLinkError_t.X_LINK_INSUFFICIENT_PERMISSIONS


@dataclass(frozen=True, slots=True)
class FoundOak:
    """One OAK device that answers, opened or not."""

    device_id: str
    """What `camera.device` takes, as it takes an address: the id (MxId)."""
    name: str
    """IP address, or USB path."""
    protocol: str
    """`usb`, `ethernet` or the library's own word."""
    problem: str | None
    """Why it cannot be opened, and what to do; None where it can."""


def found_oaks() -> tuple[FoundOak, ...]:
    """Ask USB and the local network; takes up to a second.

    Raises:
        DeviceNotFoundError: the search itself failed.
    """
    return tuple(_found(info) for info in _search(""))


def find_oak(wanted: str) -> dai.DeviceInfo:
    """Return the device that a profile means.

    Args:
        wanted: device id, IP address, host name, or empty for the only one there is.

    Raises:
        DeviceNotFoundError: it is not there, is not permitted, or several are and none is named.
    """
    return choose_oak(wanted, _search(wanted))


def open_oak(wanted: str, config: dai.Device.Config | None = None) -> dai.Device:
    """Boot the device that a profile means, for this program alone.

    Args:
        wanted: see `find_oak`.
        config: what it must know while it boots.

    Raises:
        DeviceNotFoundError: see `find_oak`; or another program has it, or it does not boot.
    """
    info = find_oak(wanted)
    try:
        return dai.Device(config or dai.Device.Config(), info)
    except RuntimeError as error:
        raise DeviceNotFoundError(
            f"OAK {info.deviceId or info.name}",
            f"cannot be opened: {error}",
            advice="another program may use it, or it needs more power",
        ) from error


def choose_oak(wanted: str, infos: Sequence[dai.DeviceInfo]) -> dai.DeviceInfo:
    """Pick one of the devices found; see `find_oak`."""
    named = [info for info in infos if wanted in ("", info.deviceId, info.name)]
    address = None if named else _address_of(wanted)
    named = named or [info for info in infos if info.name == address]
    if len(named) == 1:
        if named[0].status == _LOCKED:
            raise DeviceNotFoundError(
                f"OAK {named[0].deviceId}", "is there, but may not be opened", advice=UDEV
            )
        return named[0]
    if not named and address is not None:
        return dai.DeviceInfo(address)  # beyond the reach of a broadcast, but perhaps of a packet
    there = ", ".join(f"{info.deviceId} ({info.name})" for info in infos) or "none"
    asked = f"asked for {wanted}" if wanted else "asked for the only OAK device"
    if named:
        then = "name one of them in camera.device"
    elif infos:
        then = "correct camera.device: an id, an IP address, or a host name that is known here"
    else:
        then = "check power and cable; without permission they do not show: " + UDEV
    raise DeviceNotFoundError(f"OAK {wanted}".rstrip(), f"{asked}, found {there}", advice=then)


def _search(wanted: str) -> list[dai.DeviceInfo]:
    try:
        return dai.Device.getAllAvailableDevices()
    except RuntimeError as error:
        raise DeviceNotFoundError(
            f"OAK {wanted}".rstrip(),
            f"the search for devices failed: {error}",
            advice="check USB and network",
        ) from error


def _found(info: dai.DeviceInfo) -> FoundOak:
    names = {
        dai.XLinkProtocol.X_LINK_USB_VSC: "usb",
        dai.XLinkProtocol.X_LINK_TCP_IP: "ethernet",
    }
    return FoundOak(
        info.deviceId,
        info.name,
        names.get(info.protocol, info.protocol.name),
        f"no permission; {UDEV}" if info.status == _LOCKED else None,
    )


def _address_of(text: str) -> str | None:
    """Return the IP address that is written there, or that a host name stands for.

    Ids are never asked of a name server: they are of hexadecimal digits only.
    """
    try:
        return str(ipaddress.ip_address(text))
    except ValueError:
        if not text or all(sign in string.hexdigits for sign in text):
            return None
    try:
        found = socket.getaddrinfo(text, None, family=socket.AF_INET, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return None
    return str(found[0][4][0])
