"""The seam: where streams come from; nothing behind it knows whether there is a device."""

from collections.abc import Sequence
from typing import Protocol

from rig.devices import Device
from rig.factory import FactoryCamera
from rig_drivers.oak.sdk import dai


class Sensors(Device, Protocol):
    """Sensors that can be wired into a pipeline; open inside `with`."""

    @property
    def name(self) -> str:
        """Name of the device in messages."""
        ...

    @property
    def factory_calibration(self) -> Sequence[FactoryCamera] | None:
        """What the open device says of its sensors; None where it holds nothing."""
        ...

    def pipeline(self) -> dai.Pipeline:
        """Return a new pipeline on this device, or on none."""
        ...

    def outputs(self, pipeline: dai.Pipeline) -> dict[str, dai.Node.Output]:
        """Create the nodes of all sensors and return their streams by view name."""
        ...

    def temperature_degc(self) -> float | None:
        """Return the temperature of the device where it can tell."""
        ...

    def failure(self) -> str | None:
        """Return why no frames can come any more, None while they can."""
        ...
