"""Whether the cable can carry the pictures: asked before a stream starts, not found out after."""

from rig.errors import ConfigError
from rig.profile import OakCameraConfig
from rig_drivers.oak.raw10 import packed_bytes
from rig_drivers.oak.sdk import dai

_USB3_MB_S = 312.0
"""2.5 Gbit/s, what Luxonis' deployment guide calls the downlink to expect of USB 3."""
_USB2_MB_S = 40.0
"""480 Mbit/s on the wire, less what bulk transfers of USB 2 lose."""
_ETHERNET_MB_S = 99.0
"""797 Mbit/s, Luxonis' own measurement over gigabit Ethernet."""
_FULL_SPEED_MB_S = 1.0


def needed_mb_s(config: OakCameraConfig, sensors: int) -> float:
    """Return the data rate of so many sensors, in MB/s (10^6 bytes)."""
    row_bytes = config.width_px if config.pixels == "gray8" else packed_bytes(config.width_px)
    return sensors * row_bytes * config.height_px * config.rate_hz / 1e6


def link_of(device: dai.DeviceBase) -> tuple[str, float]:
    """Return name and usable data rate (MB/s) of the link to a device."""
    if device.getProtocol() == dai.XLinkProtocol.X_LINK_TCP_IP:
        return "gigabit Ethernet", _ETHERNET_MB_S
    match device.getUsbSpeed():
        case dai.UsbSpeed.SUPER | dai.UsbSpeed.SUPER_PLUS:
            return "USB 3", _USB3_MB_S
        case dai.UsbSpeed.HIGH:
            return "USB 2", _USB2_MB_S
        case speed:
            return f"USB at {speed.name} speed", _FULL_SPEED_MB_S


def require_bandwidth(
    config: OakCameraConfig, sensors: int, *, link: str, available_mb_s: float, device: str
) -> None:
    """Refuse to start a stream that the link cannot carry.

    Args:
        config: size, pixels and rate.
        sensors: how many of them stream over this link.
        link: its name, for messages.
        available_mb_s: its usable data rate.
        device: name used in messages.

    Raises:
        ConfigError: it needs more; says how much, and the rate that would fit.
    """
    wanted_mb_s = needed_mb_s(config, sensors)
    if wanted_mb_s <= available_mb_s:
        return
    fits_hz = config.rate_hz * available_mb_s / wanted_mb_s
    cable = "use a USB 3 cable and port (often blue), " if link.startswith("USB 2") else ""
    raise ConfigError(
        f"{device}: {sensors} x {config.width_px} x {config.height_px} px {config.pixels} at "
        f"{config.rate_hz:g} Hz need {wanted_mb_s:.1f} MB/s, {link} carries "
        f"{available_mb_s:.0f} MB/s",
        advice=f"{cable}lower camera.rate_hz to {fits_hz:.1f} or the size",
    )
