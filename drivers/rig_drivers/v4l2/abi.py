"""The kernel's Video4Linux2 requests and constants.

Source: Linux UAPI headers `linux/videodev2.h` and `linux/v4l2-controls.h`.
"""

import ctypes
from typing import Final

from rig_drivers.v4l2 import structures

_WRITE, _READ = 1, 2


def _request(direction: int, number: int, size: int) -> int:
    """Return a request number, as the kernel's `_IOC` macro for the video class `V` does."""
    return direction << 30 | size << 16 | ord("V") << 8 | number


def _both(number: int, structure: type[ctypes.Structure]) -> int:
    return _request(_READ | _WRITE, number, ctypes.sizeof(structure))


VIDIOC_QUERYCAP: Final = _request(_READ, 0, ctypes.sizeof(structures.Capability))
VIDIOC_ENUM_FMT: Final = _both(2, structures.FormatDescription)
VIDIOC_G_FMT: Final = _both(4, structures.Format)
VIDIOC_S_FMT: Final = _both(5, structures.Format)
VIDIOC_REQBUFS: Final = _both(8, structures.RequestBuffers)
VIDIOC_QUERYBUF: Final = _both(9, structures.Buffer)
VIDIOC_QBUF: Final = _both(15, structures.Buffer)
VIDIOC_DQBUF: Final = _both(17, structures.Buffer)
VIDIOC_STREAMON: Final = _request(_WRITE, 18, ctypes.sizeof(ctypes.c_int))
VIDIOC_STREAMOFF: Final = _request(_WRITE, 19, ctypes.sizeof(ctypes.c_int))
VIDIOC_G_PARM: Final = _both(21, structures.StreamParameters)
VIDIOC_S_PARM: Final = _both(22, structures.StreamParameters)
VIDIOC_QUERYMENU: Final = _both(37, structures.QueryMenu)
VIDIOC_G_EXT_CTRLS: Final = _both(71, structures.ExtendedControls)
VIDIOC_S_EXT_CTRLS: Final = _both(72, structures.ExtendedControls)
VIDIOC_ENUM_FRAMESIZES: Final = _both(74, structures.FrameSize)
VIDIOC_ENUM_FRAMEINTERVALS: Final = _both(75, structures.FrameInterval)
VIDIOC_QUERY_EXT_CTRL: Final = _both(103, structures.QueryExtendedControl)

BUF_TYPE_VIDEO_CAPTURE: Final = 1
BUF_TYPE_VIDEO_CAPTURE_MPLANE: Final = 9
MEMORY_MMAP: Final = 1
FIELD_ANY: Final = 0
FIELD_NONE: Final = 1

CAP_VIDEO_CAPTURE: Final = 0x0000_0001
CAP_VIDEO_CAPTURE_MPLANE: Final = 0x0000_1000
CAP_STREAMING: Final = 0x0400_0000
CAP_DEVICE_CAPS: Final = 0x8000_0000
PARAMETER_TIME_PER_FRAME: Final = 0x1000

DISCRETE: Final = 1
"""Type of a frame size or interval that is one value and no range."""

BUF_FLAG_ERROR: Final = 0x0000_0040
BUF_FLAG_TIMESTAMP_MASK: Final = 0x0000_E000
BUF_FLAG_TIMESTAMP_MONOTONIC: Final = 0x0000_2000
BUF_FLAG_TIMESTAMP_SOURCE_MASK: Final = 0x0007_0000
BUF_FLAG_TIMESTAMP_START_OF_EXPOSURE: Final = 0x0001_0000

CTRL_TYPE_INTEGER: Final = 1
CTRL_TYPE_BOOLEAN: Final = 2
CTRL_TYPE_MENU: Final = 3
CTRL_TYPE_BUTTON: Final = 4
CTRL_TYPE_INTEGER64: Final = 5
CTRL_TYPE_CLASS: Final = 6
CTRL_TYPE_STRING: Final = 7
CTRL_TYPE_BITMASK: Final = 8
CTRL_TYPE_INTEGER_MENU: Final = 9
CTRL_FLAG_DISABLED: Final = 0x0001
CTRL_FLAG_READ_ONLY: Final = 0x0004
CTRL_FLAG_INACTIVE: Final = 0x0010
CTRL_FLAG_WRITE_ONLY: Final = 0x0040
CTRL_FLAG_HAS_PAYLOAD: Final = 0x0100
CTRL_FLAG_NEXT: Final = 0x8000_0000
CTRL_FLAG_NEXT_COMPOUND: Final = 0x4000_0000
CTRL_WHICH_CURRENT: Final = 0

CID_AUTO_WHITE_BALANCE: Final = 0x0098_090C
CID_EXPOSURE: Final = 0x0098_0911
CID_AUTOGAIN: Final = 0x0098_0912
CID_GAIN: Final = 0x0098_0913
CID_WHITE_BALANCE_TEMPERATURE: Final = 0x0098_091A
CID_EXPOSURE_AUTO: Final = 0x009A_0901
CID_EXPOSURE_ABSOLUTE: Final = 0x009A_0902
CID_EXPOSURE_AUTO_PRIORITY: Final = 0x009A_0903
CID_FOCUS_ABSOLUTE: Final = 0x009A_090A
CID_FOCUS_AUTO: Final = 0x009A_090C
CID_ANALOGUE_GAIN: Final = 0x009E_0903


_BIG_ENDIAN: Final = 1 << 31


def fourcc(name: str) -> int:
    """Return the kernel's number of a four-letter pixel format; short names are padded."""
    return int.from_bytes(name.ljust(4).encode("ascii"), "little")


def fourcc_name(number: int) -> str:
    """Return the letters of a pixel format, `-BE` behind those of a big-endian one.

    What is no letter shows as `?`.
    """
    raw = (number & ~_BIG_ENDIAN).to_bytes(4, "little")
    letters = "".join(chr(byte) if 32 <= byte < 127 else "?" for byte in raw).rstrip()
    return letters + ("-BE" if number & _BIG_ENDIAN else "")
