"""Whether the cable can carry the pictures: asked before a stream starts, not found out after."""

from collections import Counter
from collections.abc import Iterable

from rig.errors import ConfigError
from rig.profile import OakCameraConfig
from rig_drivers.oak.raw10 import packed_bytes
from rig_drivers.oak.sdk import dai

ETHERNET = "gigabit Ethernet"
"""What a link by network is taken for: nothing tells how fast its slowest part is."""
_USB3_MB_S = 312.0
"""2.5 Gbit/s, what Luxonis' deployment guide calls the downlink to expect of USB 3."""
_USB2_MB_S = 40.0
"""480 Mbit/s on the wire, less what bulk transfers of USB 2 lose."""
_ETHERNET_MB_S = 99.0
"""797 Mbit/s, Luxonis' own measurement over gigabit Ethernet."""
_FULL_SPEED_MB_S = 1.0
_NO_CABLE = (
    dai.XLinkProtocol.X_LINK_LOCAL_SHDMEM,
    dai.XLinkProtocol.X_LINK_TCP_IP_OR_LOCAL_SHDMEM,
    dai.XLinkProtocol.X_LINK_IPC,
    dai.XLinkProtocol.X_LINK_PCIE,
)
"""The program runs on the device itself, or beside it on one board."""


def needed_mb_s(config: OakCameraConfig, views: Iterable[str]) -> float:
    """Return the data rate of the sensors of some views, in MB/s (10^6 bytes)."""
    return sum(_picture_bytes(config.of(view)) for view in views) * config.rate_hz / 1e6


def link_of(device: dai.DeviceBase) -> tuple[str, float | None]:
    """Return name and usable data rate (MB/s) of the link to a device; None where it is unknown."""
    protocol = device.getProtocol()
    if protocol == dai.XLinkProtocol.X_LINK_TCP_IP:
        return ETHERNET, _ETHERNET_MB_S
    if protocol in _NO_CABLE:
        return "no cable", None
    match device.getUsbSpeed():
        case dai.UsbSpeed.SUPER | dai.UsbSpeed.SUPER_PLUS:
            return "USB 3", _USB3_MB_S
        case dai.UsbSpeed.HIGH:
            return "USB 2", _USB2_MB_S
        case dai.UsbSpeed.UNKNOWN:
            return "a link of unknown speed", None
        case speed:
            return f"USB at {speed.name} speed", _FULL_SPEED_MB_S


def require_bandwidth(
    config: OakCameraConfig,
    views: Iterable[str],
    *,
    link: str,
    available_mb_s: float | None,
    device: str,
) -> None:
    """Refuse to start a stream that the link cannot carry.

    Args:
        config: size, pixels and rate.
        views: those whose sensors stream over this link.
        link: its name, for messages.
        available_mb_s: its usable data rate; None where it is unknown: then only what arrives
            tells, see `Arrivals`.
        device: name used in messages.

    Raises:
        ConfigError: it needs more; says how much, and the rate that would fit.
    """
    views = tuple(views)
    wanted_mb_s = needed_mb_s(config, views)
    if available_mb_s is None or wanted_mb_s <= available_mb_s:
        return
    fits_hz = config.rate_hz * available_mb_s / wanted_mb_s
    cable = "use a USB 3 cable and port (often blue), " if link.startswith("USB 2") else ""
    raise ConfigError(
        f"{device}: {_in_words(config, views)} at {config.rate_hz:g} Hz need {wanted_mb_s:.1f} "
        f"MB/s, {link} carries {available_mb_s:.0f} MB/s",
        advice=f"{cable}lower camera.rate_hz to {fits_hz:.1f} or the size",
    )


def _picture_bytes(config: OakCameraConfig) -> float:
    """Of one picture; NV12 has two bytes of colour for four pixels."""
    match config.pixels:
        case "raw10":
            return packed_bytes(config.width_px) * config.height_px
        case "nv12":
            return 1.5 * config.width_px * config.height_px
        case "gray8":
            return config.width_px * config.height_px


def _in_words(config: OakCameraConfig, views: Iterable[str]) -> str:
    sensors = [config.of(view) for view in views]
    kinds = Counter(f"{one.width_px} x {one.height_px} px {one.pixels}" for one in sensors)
    return " and ".join(f"{count} x {kind}" for kind, count in kinds.items())
