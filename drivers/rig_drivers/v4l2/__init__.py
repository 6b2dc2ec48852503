"""V4L2 cameras over a thin own layer: ioctl, mmap and poll, nothing else.

From the outside in: `camera` (one device keeps `rig.devices.Camera`), `settings`, `controls`,
`formats`, `rate`, `stream`, `buffers`, `pixels`, `jpeg` (with `jpeg_header`, `jpeg_scan` and
`jpeg_seams`), `node`, `kernel` (the system calls, the seam for tests), `abi` and
`structures` (the kernel's own numbers and layouts). `inventory` lists what is plugged in.
"""
