"""A simulated GRBL 1.1h controller.

The firmware of a real one is a single program that blocks: on a full planner, on a dwell, on
homing. Here that program is a generator that yields wherever the real one would wait; interrupts
(received bytes, the end of a motion, the switch) set flags that it looks at, as on the chip. What
it says and when follows GRBL 1.1h; it leaves out arcs, probing, spindle, coolant, overrides,
check mode and the safety door.
"""

from rig_sim.firmware.grbl.firmware import GrblFirmware

__all__ = ["GrblFirmware", "make"]

make = GrblFirmware
"""What `rig_sim.bench.make_firmware` calls."""
