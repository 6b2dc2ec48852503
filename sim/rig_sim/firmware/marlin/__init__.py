"""A simulated Marlin 2.1 controller.

A queue of four lines, a planner, and a main loop that prints `busy` while a command is at work;
lines with numbers are checked as they arrive. What it says and when follows Marlin 2.1; it leaves
out heating, extruding, probing, levelling, memory cards and displays.
"""

from rig_sim.firmware.marlin.firmware import MarlinFirmware

__all__ = ["MarlinFirmware", "make"]

make = MarlinFirmware
"""What `rig_sim.bench.make_firmware` calls."""
