"""The simulated Marlin as its serial line sees it."""

from rig.devices import Clock
from rig.profile import FirmwareConfig
from rig_sim.carriage import Carriage
from rig_sim.firmware.chip import ChipFirmware
from rig_sim.firmware.marlin.machine import Machine
from rig_sim.firmware.marlin.program import run


class MarlinFirmware(ChipFirmware):
    """Keeps `rig_sim.wire.Firmware`."""

    def __init__(self, config: FirmwareConfig, carriage: Carriage, clock: Clock) -> None:
        machine = Machine(config, carriage, clock.now_s())
        super().__init__(machine, lambda: run(machine, config.boot_s), clock)
