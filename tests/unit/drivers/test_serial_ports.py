"""Ports by names that stay: links of udev, serial numbers of USB adapters."""

from pathlib import Path

import pytest
from rig_drivers.stage.serial_line import SerialLine
from rig_drivers.stage.serial_ports import (
    SerialPort,
    list_serial_ports,
    path_of_adapter,
    stable_paths,
)

from rig.devices import SystemClock
from rig.errors import DeviceNotFoundError

PORTS = (
    SerialPort("/dev/ttyS0", None, None, "ttyS0"),
    SerialPort("/dev/ttyUSB0", "/dev/serial/by-id/usb-FTDI_AB12", "AB12", "FT232R"),
    SerialPort("/dev/ttyUSB1", None, "CD34", "CP2102"),
    SerialPort("/dev/ttyUSB2", None, "CD34", "CP2102"),
)


def test_a_port_is_named_by_what_stays() -> None:
    assert [port.name for port in PORTS] == [
        "/dev/ttyS0",
        "/dev/serial/by-id/usb-FTDI_AB12",
        "usb-serial:CD34",
        "usb-serial:CD34",
    ]


def test_links_lead_to_their_devices(tmp_path: Path) -> None:
    device = tmp_path / "ttyUSB7"
    device.touch()
    folder = tmp_path / "by-id"
    folder.mkdir()
    (folder / "usb-1a86_USB_Serial").symlink_to("../ttyUSB7")
    assert stable_paths(folder) == {str(device): str(folder / "usb-1a86_USB_Serial")}
    assert stable_paths(tmp_path / "absent") == {}


def test_an_adapter_is_found_by_its_number() -> None:
    assert path_of_adapter("AB12", PORTS, device="stage") == "/dev/ttyUSB0"
    with pytest.raises(DeviceNotFoundError, match=r"no adapter .* XX, there are: AB12 \(/dev"):
        path_of_adapter("XX", PORTS, device="stage")
    with pytest.raises(
        DeviceNotFoundError, match=r"2 adapters .* CD34: /dev/ttyUSB1, /dev/ttyUSB2"
    ):
        path_of_adapter("CD34", PORTS, device="stage")


def test_opening_by_number_looks_at_this_machine() -> None:
    line = SerialLine("usb-serial:no-such", 115200, clock=SystemClock(), device="stage")
    with pytest.raises(DeviceNotFoundError, match="USB serial number no-such, there are"):
        line.open()


def test_the_ports_of_this_machine_are_listed() -> None:
    assert all(Path(port.path).exists() for port in list_serial_ports())
