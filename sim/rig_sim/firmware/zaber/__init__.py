"""A simulated chain of Zaber devices with firmware 7.

Every command is answered at once; motions run beside. What it says follows the Zaber ASCII protocol
manual; it leaves out streams, triggers, storage, lockstep, parking, and inputs and outputs.
"""

from rig_sim.firmware.zaber.chain import ZaberFirmware

__all__ = ["ZaberFirmware", "make"]

make = ZaberFirmware
"""What `rig_sim.bench.make_firmware` calls."""
