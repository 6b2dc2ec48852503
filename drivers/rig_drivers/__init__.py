"""Drivers of real hardware and of stored frames; each keeps a protocol of `rig.devices`."""
