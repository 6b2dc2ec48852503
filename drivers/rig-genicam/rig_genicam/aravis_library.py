"""Which cameras Aravis finds, and the one that a profile names."""

import ipaddress
import threading
import time
from collections.abc import Sequence
from typing import Final

from rig.errors import DeviceNotFoundError
from rig_genicam.aravis import Aravis, CallError
from rig_genicam.aravis_device import AravisDevice
from rig_genicam.door import GenicamDevice, Offer

_FRESH_S: Final = 2.0
"""Cameras that are opened together look around once."""


class AravisLibrary:
    """Finds and opens cameras; keeps `GenicamLibrary`. May be used by several threads.

    Args:
        aravis: the library.
    """

    def __init__(self, aravis: Aravis) -> None:
        self._aravis = aravis
        self._looking = threading.Lock()
        self._offers: tuple[Offer, ...] = ()
        self._looked_s = float("-inf")

    def offers(self) -> Sequence[Offer]:
        """See `GenicamLibrary.offers`; asks the networks and USB, which takes a second."""
        with self._looking:
            if time.monotonic() - self._looked_s > _FRESH_S:
                self._aravis("update_device_list")
                self._offers = tuple(map(self._offer, range(self._aravis("get_n_devices"))))
                self._looked_s = time.monotonic()
            return self._offers

    def _offer(self, index: int) -> Offer:
        def told(what: str) -> str:
            return self._aravis(f"get_device_{what}", index) or ""

        protocol = told("protocol")
        return Offer(
            serial=told("serial_nbr"),
            name=told("id"),
            vendor=told("vendor"),
            model=told("model"),
            address=told("address") if protocol == "GigEVision" else "",
            protocol=protocol,
        )

    def open(self, name: str) -> GenicamDevice:
        """See `GenicamLibrary.open`; `name` is a serial number, a name or an address.

        Raises:
            DeviceNotFoundError: it is not there, two have this name, or another program has it.
        """
        camera = f"camera {name}"
        try:
            handle = self._aravis.checked("open_device", self._its_own_name(name))
        except CallError as error:
            if not _is_address(name) and not self._named(name):
                raise self._absent(camera) from error
            raise DeviceNotFoundError(
                camera,
                f"cannot be opened: {error}",
                advice="check cable, power and addresses (`rig devices` lists what is there), and "
                "on USB the rights (udev)",
            ) from error
        if not handle:
            raise self._absent(camera)
        if self._aravis.is_a(handle, "gv_device") and not self._aravis(
            "gv_device_is_controller", handle
        ):
            self._aravis.release(handle)
            raise DeviceNotFoundError(
                camera,
                "is controlled by another program",
                advice="end that, or wait some seconds where it ended without a word",
            )
        return AravisDevice(self._aravis, handle, camera)

    def _its_own_name(self, name: str) -> str:
        """Return what the library opens it by; an address is asked itself, nothing is searched.

        Raises:
            DeviceNotFoundError: it is not there, or two cameras have this name.
        """
        if _is_address(name):
            return name
        found = self._named(name)
        if len(found) > 1:
            raise DeviceNotFoundError(
                f"camera {name}",
                f"is the name of {len(found)} cameras: {', '.join(o.name for o in found)}",
                advice="name it by what stands here",
            )
        return found[0].name if found else name  # perhaps the name that its user gave it

    def _named(self, name: str) -> list[Offer]:
        return [o for o in self.offers() if name in (o.serial, o.name, o.address)]

    def _absent(self, camera: str) -> DeviceNotFoundError:
        listed = ", ".join(offer.serial or offer.name for offer in self.offers()) or "none at all"
        return DeviceNotFoundError(
            camera,
            f"is not there, found {listed}",
            advice="check cable and power, or correct camera.devices (`rig devices` lists them)",
        )


def _is_address(name: str) -> bool:
    try:
        ipaddress.IPv4Address(name)
    except ValueError:
        return False
    return True
