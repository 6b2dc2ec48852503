"""From bytes to pictures, by the layouts of the naming convention."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_genicam.config import PixelFormat
from rig_genicam.pixels import PixelError, layout_of, to_picture

FORMATS = get_args(PixelFormat)


def picture(
    data: list[int], pixel_format: str, width_px: int, height_px: int, padding_bytes: int = 0
):
    return to_picture(
        np.array(data, np.uint8),
        pixel_format,
        width_px=width_px,
        height_px=height_px,
        padding_bytes=padding_bytes,
    )[0]


@pytest.mark.parametrize(
    ("pixel_format", "data", "values"),
    [
        ("Mono8", [1, 2, 250], [1, 2, 250]),
        ("Mono10", [0x34, 0x02, 0xFF, 0x03], [0x234, 0x3FF]),
        ("Mono12", [0x34, 0x0A], [0xA34]),
        ("Mono14", [0x34, 0x2A], [0x2A34]),
        ("Mono16", [0x34, 0xBA], [0xBA34]),
        ("Mono10p", [0xFF, 0x03, 0x00, 0x00, 0x80], [0x3FF, 0x000, 0x000, 0x200]),
        ("Mono10p", [0x01, 0x08, 0x30, 0x00, 0x01], [0x001, 0x002, 0x003, 0x004]),
        ("Mono10p", [0x01, 0x08, 0x30, 0x00], [0x001, 0x002, 0x003]),
        ("Mono10p", [0b10101010, 0b01010110, 0b1100_1001, 0b10_110011, 0xFE],
         [0b10_10101010, 0b1001_010101, 0b110011_1100, 0b11111110_10]),
        ("Mono12p", [0x21, 0x43, 0x65], [0x321, 0x654]),
        ("Mono12p", [0x21, 0x43, 0x65, 0x87, 0x09], [0x321, 0x654, 0x987]),
        ("Mono10Packed", [0x80, 0x21, 0xFF], [0x201, 0x3FE]),
        ("Mono12Packed", [0x80, 0x21, 0xFF], [0x801, 0xFF2]),
        ("Mono12Packed", [0x12, 0x03], [0x123]),
    ],
)  # fmt: skip
def test_values_are_the_sensors_counts(pixel_format: str, data: list[int], values: list[int]):
    image = picture(data, pixel_format, len(values), 1)
    assert image.tolist() == [values]
    assert image.dtype == (np.uint8 if pixel_format == "Mono8" else np.uint16)


@pytest.mark.parametrize(
    ("pixel_format", "colours", "bits", "pixel_bits"),
    [
        ("Mono8", "", 8, 8),
        ("Mono10", "", 10, 16),
        ("Mono10p", "", 10, 10),
        ("Mono10Packed", "", 10, 12),
        ("Mono12p", "", 12, 12),
        ("BayerRG12Packed", "RGGB", 12, 12),
        ("BayerGB8", "GBRG", 8, 8),
        ("BayerBG16", "BGGR", 16, 16),
        ("BayerGR10p", "GRBG", 10, 10),
        ("RGB8", "RGB", 8, 24),
        ("BGR8", "BGR", 8, 24),
    ],
)
def test_a_name_tells_the_layout(pixel_format: str, colours: str, bits: int, pixel_bits: int):
    layout = layout_of(pixel_format)
    assert (layout.colours, layout.bits, layout.pixel_bits) == (colours, bits, pixel_bits)


@pytest.mark.parametrize("name", ["YUV422_8", "Mono8s", "Mono9", "Mono16p", "mono8", "BayerXX8"])
def test_other_formats_are_refused(name: str):
    with pytest.raises(PixelError, match="cannot be read"):
        layout_of(name)


def test_a_mosaic_of_one_colour_is_grey_and_keeps_its_colour():
    mosaic = np.zeros((6, 6), np.uint8)
    mosaic[::2, ::2] = 200  # red alone
    grey, colour = to_picture(mosaic.ravel(), "BayerRG8", width_px=6, height_px=6)
    assert set(grey[1:-1, 1:-1].ravel()) == {50}
    assert colour is not None
    assert colour[2, 2].tolist() == [200, 0, 0]


def test_twelve_bits_of_a_mosaic_have_eight_in_colour():
    mosaic = np.full((4, 4), 0xABC, "<u2")
    grey, colour = to_picture(
        np.frombuffer(mosaic.tobytes(), np.uint8), "BayerGB12", width_px=4, height_px=4
    )
    assert set(grey.ravel()) == {0xABC}
    assert colour is not None
    assert set(colour.ravel()) == {0xAB}


def test_colour_is_left_out_where_nobody_wants_it():
    _, colour = to_picture(
        np.zeros(16, np.uint8), "BayerRG8", width_px=4, height_px=4, colour=False
    )
    assert colour is None


@pytest.mark.parametrize(("name", "red"), [("RGB8", [255, 0, 0]), ("BGR8", [0, 0, 255])])
def test_pixels_of_three_values_are_luma(name: str, red: list[int]):
    grey, colour = to_picture(np.array(red * 2, np.uint8), name, width_px=2, height_px=1)
    assert grey.tolist() == [[76, 76]]
    assert colour is not None
    assert colour.tolist() == [[[255, 0, 0], [255, 0, 0]]]


def test_gaps_behind_lines_are_left_out():
    assert picture([1, 2, 99, 3, 4, 99], "Mono8", 2, 2, padding_bytes=1).tolist() == [
        [1, 2],
        [3, 4],
    ]
    with pytest.raises(PixelError, match=r"5 bytes are no 2 lines of 2 \+ 1 bytes"):
        picture([1, 2, 99, 3, 4], "Mono8", 2, 2, padding_bytes=1)


def test_chunks_behind_a_picture_are_none_of_it():
    assert picture([1, 2, 3, 4, 99, 99], "Mono8", 2, 2).tolist() == [[1, 2], [3, 4]]


@settings(max_examples=60)
@given(
    data=st.binary(max_size=200),
    pixel_format=st.sampled_from(FORMATS),
    width_px=st.integers(1, 9),
    height_px=st.integers(1, 7),
    padding_bytes=st.integers(0, 3),
)
def test_any_bytes_are_a_picture_of_the_size_or_refused(
    data: bytes, pixel_format: str, width_px: int, height_px: int, padding_bytes: int
):
    layout = layout_of(pixel_format)
    needed = layout.size_bytes(width_px * height_px)
    if padding_bytes:
        needed = height_px * (layout.size_bytes(width_px) + padding_bytes)
    try:
        image, _ = to_picture(
            np.frombuffer(data, np.uint8),
            pixel_format,
            width_px=width_px,
            height_px=height_px,
            padding_bytes=padding_bytes,
        )
    except PixelError:
        is_small_mosaic = layout.pixel_bits < 24 and layout.colours and min(width_px, height_px) < 3
        assert len(data) < needed or is_small_mosaic
    else:
        assert image.shape == (height_px, width_px)
        assert int(image.max()) < 1 << layout.bits or pixel_format.endswith(("10", "12", "14"))
