"""V4L2 cameras over a thin own layer: ioctl, mmap and poll, nothing else.

From the outside in: `camera` (one device keeps `rig.devices.Camera`), `settings`, `controls`,
`formats`, `stream`, `pixels`, `node`, `kernel` (the system calls, the seam for tests), `abi` and
`structures` (the kernel's own numbers and layouts). `inventory` lists what is plugged in.
"""

from rig_drivers.v4l2.camera import V4l2Camera
from rig_drivers.v4l2.inventory import VideoNode, video_nodes
from rig_drivers.v4l2.kernel import Kernel, LinuxKernel

__all__ = ["Kernel", "LinuxKernel", "V4l2Camera", "VideoNode", "video_nodes"]
