"""Stored JPEG pictures, of any program: those that are surely damaged."""

import numpy as np

from rig_drivers.jpeg.header import ForeignJpegError, read_header
from rig_drivers.jpeg.scan import walk_scan


def require_whole(content: bytes) -> None:
    """Read every code of a picture; progressive pictures and other rare ones are not looked into.

    What only looks odd passes: unlike a camera, a file has no next picture to compare it with, and
    some encoders let pixels beyond 8 bits on purpose.

    Args:
        content: a file that a decoder has read.

    Raises:
        JpegDamageError: its codes are damaged.
    """
    try:
        header = read_header(content)
    except ForeignJpegError:
        return
    walk_scan(np.frombuffer(content, np.uint8), header, is_of_camera=False)
