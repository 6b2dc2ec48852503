"""Luxonis OAK cameras over DepthAI v3; nothing else in this project knows that library.

    sensors (device or host nodes) -> streams (Sync, queues) -> decode -> OakCamera

`sensors` is the seam: with a device or without one, everything behind it is the same code.
"""
