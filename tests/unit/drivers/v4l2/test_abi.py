"""Request numbers and layouts, against what a C compiler makes of the kernel's header."""

import ctypes

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.v4l2 import abi, structures

# Printed by a C program around <linux/videodev2.h> on x86-64. A request number holds the size of
# its structure, so that these hold the sizes too.
REQUESTS = {
    "VIDIOC_QUERYCAP": 0x80685600,
    "VIDIOC_ENUM_FMT": 0xC0405602,
    "VIDIOC_G_FMT": 0xC0D05604,
    "VIDIOC_S_FMT": 0xC0D05605,
    "VIDIOC_REQBUFS": 0xC0145608,
    "VIDIOC_QUERYBUF": 0xC0585609,
    "VIDIOC_QBUF": 0xC058560F,
    "VIDIOC_DQBUF": 0xC0585611,
    "VIDIOC_STREAMON": 0x40045612,
    "VIDIOC_STREAMOFF": 0x40045613,
    "VIDIOC_G_PARM": 0xC0CC5615,
    "VIDIOC_S_PARM": 0xC0CC5616,
    "VIDIOC_ENUM_FRAMESIZES": 0xC02C564A,
    "VIDIOC_ENUM_FRAMEINTERVALS": 0xC034564B,
    "VIDIOC_QUERY_EXT_CTRL": 0xC0E85667,
    "VIDIOC_QUERYMENU": 0xC02C5625,
    "VIDIOC_G_EXT_CTRLS": 0xC0205647,
    "VIDIOC_S_EXT_CTRLS": 0xC0205648,
}


@pytest.mark.parametrize(("name", "number"), REQUESTS.items())
def test_request_numbers_are_the_kernels(name: str, number: int):
    assert getattr(abi, name) == number


USER, CAMERA, IMAGE_SOURCE = ((number << 16) + 0x900 for number in (0x98, 0x9A, 0x9E))
"""Where the numbers of a class of controls begin."""
BIT = [1 << number for number in range(32)]
CONSTANTS = {
    # enumerations
    "BUF_TYPE_VIDEO_CAPTURE": 1, "BUF_TYPE_VIDEO_CAPTURE_MPLANE": 9, "MEMORY_MMAP": 1,
    "FIELD_ANY": 0, "FIELD_NONE": 1, "DISCRETE": 1,
    "CTRL_TYPE_INTEGER": 1, "CTRL_TYPE_BOOLEAN": 2, "CTRL_TYPE_MENU": 3, "CTRL_TYPE_BUTTON": 4,
    "CTRL_TYPE_INTEGER64": 5, "CTRL_TYPE_CLASS": 6, "CTRL_TYPE_STRING": 7, "CTRL_TYPE_BITMASK": 8,
    "CTRL_TYPE_INTEGER_MENU": 9, "CTRL_WHICH_CURRENT": 0,
    # flags, one bit each
    "CAP_VIDEO_CAPTURE": BIT[0], "CAP_VIDEO_CAPTURE_MPLANE": BIT[12], "CAP_STREAMING": BIT[26],
    "CAP_DEVICE_CAPS": BIT[31], "PARAMETER_TIME_PER_FRAME": BIT[12],
    "BUF_FLAG_ERROR": BIT[6], "BUF_FLAG_TIMESTAMP_MONOTONIC": BIT[13],
    "BUF_FLAG_TIMESTAMP_START_OF_EXPOSURE": BIT[16],
    "CTRL_FLAG_DISABLED": BIT[0], "CTRL_FLAG_READ_ONLY": BIT[2], "CTRL_FLAG_INACTIVE": BIT[4],
    "CTRL_FLAG_WRITE_ONLY": BIT[6], "CTRL_FLAG_HAS_PAYLOAD": BIT[8], "CTRL_FLAG_NEXT": BIT[31],
    "CTRL_FLAG_NEXT_COMPOUND": BIT[30],
    # masks
    "BUF_FLAG_TIMESTAMP_MASK": sum(BIT[13:16]), "BUF_FLAG_TIMESTAMP_SOURCE_MASK": sum(BIT[16:19]),
    # numbers of controls
    "CID_AUTO_WHITE_BALANCE": USER + 12, "CID_EXPOSURE": USER + 17, "CID_AUTOGAIN": USER + 18,
    "CID_GAIN": USER + 19, "CID_WHITE_BALANCE_TEMPERATURE": USER + 26,
    "CID_EXPOSURE_AUTO": CAMERA + 1, "CID_EXPOSURE_ABSOLUTE": CAMERA + 2,
    "CID_EXPOSURE_AUTO_PRIORITY": CAMERA + 3, "CID_FOCUS_ABSOLUTE": CAMERA + 10,
    "CID_FOCUS_AUTO": CAMERA + 12, "CID_ANALOGUE_GAIN": IMAGE_SOURCE + 3,
}  # fmt: skip


def test_constants_are_the_kernels():
    ours = {
        name: value
        for name, value in vars(abi).items()
        if name.isupper() and not name.startswith(("_", "VIDIOC"))
    }
    assert ours == CONSTANTS


@pytest.mark.parametrize(
    ("letters", "number"),
    [
        ("YUYV", 0x56595559),  # a | b << 8 | c << 16 | d << 24, as the header has it
        ("GREY", 0x59455247),
        ("Y16", 0x20363159),
    ],
)
def test_letters_of_a_pixel_format_are_its_bytes_lowest_first(letters: str, number: int):
    assert abi.fourcc(letters) == number
    assert abi.fourcc_name(number) == letters


@pytest.mark.parametrize(("byte", "shown"), [(31, "?"), (32, " "), (126, "~"), (127, "?")])
def test_bytes_that_are_no_letter_show_as_a_question_mark(byte: int, shown: str):
    assert abi.fourcc_name(byte | abi.fourcc("\0ABC")) == f"{shown}ABC"


def test_fields_lie_where_the_kernel_has_them():
    assert structures.Buffer.timestamp.offset == 24
    assert structures.Buffer.m.offset == 64
    assert structures.Format.fmt.offset == 8
    assert ctypes.sizeof(structures.ExtendedControl) == 20
    assert ctypes.sizeof(structures.Plane) == 64
    assert structures.Plane.data_offset.offset == 16
    assert ctypes.sizeof(structures.MultiPlanarFormat) == 192
    assert structures.MultiPlanarFormat.num_planes.offset == 180


@given(st.integers(0, 2**32 - 1))
def test_any_number_has_a_name_as_a_pixel_format(number: int):
    assert len(abi.fourcc_name(number).removesuffix("-BE")) <= 4


def test_the_big_endian_sister_of_a_pixel_format_has_another_name():
    assert abi.fourcc_name(abi.fourcc("Y16") | 1 << 31) == "Y16-BE"


@given(st.from_regex(r"[A-Z][A-Z0-9]{2,3}", fullmatch=True))
def test_names_of_pixel_formats_come_back(name: str):
    assert abi.fourcc_name(abi.fourcc(name)) == name
