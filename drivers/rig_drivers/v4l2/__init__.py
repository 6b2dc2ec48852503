"""V4L2 cameras over a thin own layer: ioctl, mmap and poll, nothing else.

From the outside in: `camera` (one device keeps `rig.devices.Camera`), `settings`, `controls`,
`formats`, `rate`, `stream`, `buffers`, `pixels`, `jpeg` (and what belongs to it), `node`, `kernel` (the system calls, the seam for tests), `abi` and
`structures` (the kernel's own numbers and layouts). `inventory` lists what is plugged in.
"""
