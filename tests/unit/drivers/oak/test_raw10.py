"""Ten-bit pixels in bytes, against a second way of packing: one long string of bits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from rig_drivers.oak.raw10 import pack_raw10, packed_bytes, unpack_raw10

shapes = st.tuples(st.integers(1, 7), st.integers(1, 33))
pictures = shapes.flatmap(
    lambda shape: hnp.arrays(np.uint16, shape, elements=st.integers(0, 1023), fill=st.nothing())
)


def packed_by_hand(row: list[int]) -> list[int]:
    """MIPI CSI-2: four upper bytes, then the lower bits of pixels 3, 2, 1, 0 in one byte."""
    found: list[int] = []
    for start in range(0, len(row), 4):
        four = [f"{pixel:010b}" for pixel in [*row[start : start + 4], 0, 0, 0][:4]]
        found += [int(pixel[:8], 2) for pixel in four]
        found.append(int("".join(pixel[8:] for pixel in reversed(four)), 2))
    return found


@settings(deadline=None, max_examples=80)
@given(pictures)
def test_packing_agrees_with_bits_written_by_hand_and_is_undone(image: np.ndarray):
    packed = pack_raw10(image)
    assert packed.tolist() == [byte for row in image.tolist() for byte in packed_by_hand(row)]
    height, width = image.shape
    np.testing.assert_array_equal(unpack_raw10(packed, width_px=width, height_px=height), image)


@settings(deadline=None, max_examples=50)
@given(pictures, st.integers(0, 9), st.integers(0, 20))
def test_padding_between_and_after_rows_changes_nothing(image: np.ndarray, pad: int, tail: int):
    height, width = image.shape
    stride = packed_bytes(width) + pad
    padded = np.full((height, stride), 0xAA, np.uint8)
    padded[:, : packed_bytes(width)] = pack_raw10(image).reshape(height, -1)
    data = np.concatenate([padded.reshape(-1), np.full(tail, 0x55, np.uint8)])
    unpacked = unpack_raw10(data, width_px=width, height_px=height, stride=stride)
    np.testing.assert_array_equal(unpacked, image)


@settings(deadline=None, max_examples=60)
@given(st.binary(max_size=80), st.integers(1, 20), st.integers(1, 6), st.integers(0, 40))
def test_any_bytes_are_pixels_or_refused(data: bytes, width: int, height: int, stride: int):
    raw = np.frombuffer(data, np.uint8)
    try:
        image = unpack_raw10(raw, width_px=width, height_px=height, stride=stride)
    except ValueError as error:
        assert "bytes" in str(error)
    else:
        assert image.shape == (height, width)
        assert image.max() <= 1023


def test_more_than_ten_bits_are_refused():
    with pytest.raises(ValueError, match=r"holds 0\.\.1023, found 1024"):
        pack_raw10(np.array([[1024]], np.uint16))
