"""What is on USB by the word of the kernel alone: no library and no permission needed."""

from dataclasses import dataclass
from pathlib import Path

SYSFS = Path("/sys/bus/usb/devices")

MOVIDIUS = "03e7"
"""USB vendor of OAK cameras, booted or not."""


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """One USB device."""

    place: str
    """Bus and port, as `1-4.2`."""
    vendor: str
    """Four hexadecimal digits."""
    product: str
    """Four hexadecimal digits."""
    name: str
    serial: str
    node: Path
    """Device file that a program opens."""


def usb_devices(root: Path = SYSFS) -> tuple[UsbDevice, ...]:
    """Return all USB devices in the order of their places; none where there is no USB.

    Args:
        root: the folder of the kernel that lists them.
    """
    found: list[UsbDevice] = []
    for folder in sorted(root.glob("*")):
        vendor, product = _read(folder / "idVendor"), _read(folder / "idProduct")
        bus, number = _read(folder / "busnum"), _read(folder / "devnum")
        if vendor and product and bus.isdigit() and number.isdigit():
            node = Path(f"/dev/bus/usb/{int(bus):03d}/{int(number):03d}")
            name = _read(folder / "product")
            found.append(
                UsbDevice(folder.name, vendor, product, name, _read(folder / "serial"), node)
            )
    return tuple(found)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
