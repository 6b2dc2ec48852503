"""The serial ports of this machine, under names that stay."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from serial.tools import list_ports

from rig.errors import DeviceNotFoundError

BY_ID = Path("/dev/serial/by-id")
"""Where udev links every USB adapter under vendor, model and serial number."""
USB_SERIAL = "usb-serial:"
"""Begins a port that is named by the serial number of its USB adapter."""


@dataclass(frozen=True, slots=True)
class SerialPort:
    """One port that is there now."""

    path: str
    """Device path of today, such as /dev/ttyUSB0."""
    stable_path: str | None
    """The path that stays when other devices are plugged in; None where udev made none."""
    usb_serial: str | None
    """Serial number of the USB adapter; many cheap ones have none."""
    description: str
    """What it calls itself."""

    @property
    def name(self) -> str:
        """What a profile should say: the stable path, else the serial number, else the path."""
        if self.stable_path is not None:
            return self.stable_path
        return self.path if self.usb_serial is None else USB_SERIAL + self.usb_serial


def list_serial_ports() -> tuple[SerialPort, ...]:
    """Return the ports of this machine in the order of their paths."""
    stable = stable_paths(BY_ID)
    found = sorted(list_ports.comports(), key=lambda port: port.device)
    return tuple(
        SerialPort(
            port.device, stable.get(port.device), port.serial_number or None, port.description
        )
        for port in found
    )


def stable_paths(folder: Path) -> Mapping[str, str]:
    """Return by device path the link in `folder` that leads to it."""
    links = sorted(folder.iterdir()) if folder.is_dir() else []
    return {str(link.resolve()): str(link) for link in links}


def resolve_port(port: str, *, device: str) -> str:
    """Return what to open: `usb-serial:NUMBER` becomes a path, anything else stays as it is.

    Args:
        port: as in a profile.
        device: name used in errors.

    Raises:
        DeviceNotFoundError: no adapter has this serial number, or more than one.
    """
    if not port.startswith(USB_SERIAL):
        return port
    return path_of_adapter(port.removeprefix(USB_SERIAL), list_serial_ports(), device=device)


def path_of_adapter(number: str, ports: Iterable[SerialPort], *, device: str) -> str:
    """Return the path of the one adapter with this serial number.

    Raises:
        DeviceNotFoundError: there is none, or more than one.
    """
    known = [port for port in ports if port.usb_serial is not None]
    paths = [port.path for port in known if port.usb_serial == number]
    if len(paths) == 1:
        return paths[0]
    if paths:
        raise DeviceNotFoundError(
            device,
            f"{len(paths)} adapters have the USB serial number {number}: {', '.join(paths)}",
            advice="name the port by its path in /dev/serial/by-path",
        )
    there = ", ".join(f"{port.usb_serial} ({port.path})" for port in known) or "none"
    raise DeviceNotFoundError(
        device,
        f"no adapter with the USB serial number {number}, there are: {there}",
        advice="check the cable, `rig devices` lists ports",
    )
