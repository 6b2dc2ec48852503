"""Serial ports that lead to a simulated firmware."""

from rig_sim.wire.sockets import Firmware, plug

__all__ = ["Firmware", "plug"]
