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


def test_fields_lie_where_the_kernel_has_them():
    assert structures.Buffer.timestamp.offset == 24
    assert structures.Buffer.m.offset == 64
    assert structures.Format.fmt.offset == 8
    assert ctypes.sizeof(structures.ExtendedControl) == 20


@given(st.integers(0, 2**32 - 1))
def test_any_number_has_a_name_as_a_pixel_format(number: int):
    assert len(abi.fourcc_name(number).removesuffix("-BE")) <= 4


def test_the_big_endian_sister_of_a_pixel_format_has_another_name():
    assert abi.fourcc_name(abi.fourcc("Y16") | 1 << 31) == "Y16-BE"


@given(st.from_regex(r"[A-Z][A-Z0-9]{2,3}", fullmatch=True))
def test_names_of_pixel_formats_come_back(name: str):
    assert abi.fourcc_name(abi.fourcc(name)) == name
