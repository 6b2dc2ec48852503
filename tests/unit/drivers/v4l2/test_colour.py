"""Bytes of a buffer as a picture in colour."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.v4l2.colour import COLOUR_READERS, to_colour
from rig_drivers.v4l2.pixels import DECODERS, PixelError, to_grey

WIDTH, HEIGHT = 12, 8
RGB = (200, 120, 40)
"""A colour that is the same all over a picture."""


def of(data: np.ndarray, name: str, stride: int = 0) -> np.ndarray:
    found = to_colour(
        np.ascontiguousarray(data).view(np.uint8).ravel(),
        name,
        width_px=WIDTH,
        height_px=HEIGHT,
        bytes_per_line=stride,
    )
    assert found is not None
    return found


def yuv_of(red: float, green: float, blue: float) -> tuple[int, int, int]:
    """Luma and chroma by BT.601, 16..235, as the standard's own formula has it."""
    y = 16.0 + (65.481 * red + 128.553 * green + 24.966 * blue) / 255.0
    u = 128.0 + (-37.797 * red - 74.203 * green + 112.0 * blue) / 255.0
    v = 128.0 + (112.0 * red - 93.786 * green - 18.214 * blue) / 255.0
    return round(y), round(u), round(v)


def test_pairs_of_pixels_share_their_colour():
    y, u, v = yuv_of(*RGB)
    orders = {
        "YUYV": (y, u, y, v),
        "YVYU": (y, v, y, u),
        "UYVY": (u, y, v, y),
        "VYUY": (v, y, u, y),
    }
    for name, four in orders.items():
        lines = np.pad(np.tile(np.array(four, np.uint8), (HEIGHT, WIDTH // 2)), ((0, 0), (0, 4)))
        found = of(lines, name, 2 * WIDTH + 4)
        assert found.shape == (HEIGHT, WIDTH, 3)
        assert np.abs(found.astype(int) - RGB).max() <= 2, name


@pytest.mark.parametrize(
    ("name", "first", "lines"),
    [("NV12", "u", 12), ("NV21", "v", 12), ("NV16", "u", 16), ("NV61", "v", 16)],
)
def test_both_colours_stand_in_turn_behind_the_luma(name: str, first: str, lines: int):
    y, u, v = yuv_of(*RGB)
    luma = np.full((HEIGHT, WIDTH + 2), y, np.uint8)
    pair = np.array((u, v) if first == "u" else (v, u), np.uint8)
    chroma = np.tile(pair, (lines - HEIGHT, (WIDTH + 2) // 2))
    found = of(np.concatenate([luma, chroma]), name, WIDTH + 2)
    assert np.abs(found.astype(int) - RGB).max() <= 2
    with pytest.raises(PixelError, match=f"needed for {lines} lines"):
        of(luma, name, WIDTH + 2)


@pytest.mark.parametrize(("name", "first"), [("YU12", "u"), ("YV12", "v")])
def test_each_colour_has_a_small_plane_behind_the_luma(name: str, first: str):
    y, u, v = yuv_of(*RGB)
    luma = np.full((HEIGHT, WIDTH + 4), y, np.uint8)
    order = (u, v) if first == "u" else (v, u)
    small = [np.full((HEIGHT // 2, (WIDTH + 4) // 2), value, np.uint8) for value in order]
    data = np.concatenate([plane.ravel() for plane in (luma, *small)])
    found = of(data, name, WIDTH + 4)
    assert np.abs(found.astype(int) - RGB).max() <= 2
    with pytest.raises(PixelError, match="needed for 8 lines"):
        of(luma, name, WIDTH + 4)


def test_an_odd_picture_has_no_pairs_of_pixels():
    data = np.zeros(4000, np.uint8)
    for name in ("YUYV", "VYUY", "NV16", "NV21", "YU12"):
        with pytest.raises(PixelError, match="px are no"):
            to_colour(data, name, width_px=11, height_px=8, bytes_per_line=44)


def test_red_comes_first_whatever_the_order_of_the_bytes():
    pixels = np.tile(np.array(RGB, np.uint8), (HEIGHT, WIDTH, 1))
    assert (of(pixels, "RGB3", 3 * WIDTH) == RGB).all()
    assert (of(pixels[..., ::-1], "BGR3", 3 * WIDTH) == RGB).all()
    for name, data in (("RGB3", pixels), ("BGR3", pixels[..., ::-1])):
        grey = to_grey(
            np.ascontiguousarray(data).ravel(),
            name,
            width_px=WIDTH,
            height_px=HEIGHT,
            bytes_per_line=3 * WIDTH,
        )
        assert (grey == round(0.299 * 200 + 0.587 * 120 + 0.114 * 40)).all()


MOSAICS = {
    "BGGR": ("BA81", "BG10", "BG12", "BG14", "BYR2", "pBAA", "pBCC"),
    "GBRG": ("GBRG", "GB10", "GB12", "GB14", "GB16", "pGAA", "pGCC"),
    "GRBG": ("GRBG", "BA10", "BA12", "GR14", "GR16", "pgAA", "pgCC"),
    "RGGB": ("RGGB", "RG10", "RG12", "RG14", "RG16", "pRAA", "pRCC"),
}


def packed(mosaic: np.ndarray, name: str) -> tuple[np.ndarray, int]:
    """The mosaic (8 bits) as a sensor of the format's depth sends it."""
    bits = DECODERS[name][1]
    if bits == 8:
        return mosaic, WIDTH
    counts = mosaic.astype(np.uint16) << (bits - 8)
    if not name.startswith("p"):
        return counts.astype("<u2"), 2 * WIDTH
    # The lower bits of every group are zero here.
    group = 4 if bits == 10 else 2
    groups = mosaic.reshape(HEIGHT, WIDTH // group, group)
    return np.pad(groups, ((0, 0), (0, 0), (0, 1))), (group + 1) * WIDTH // group


@pytest.mark.parametrize(
    ("order", "name"), [(order, name) for order, names in MOSAICS.items() for name in names]
)
def test_a_mosaic_of_one_colour_is_that_colour_everywhere(order: str, name: str):
    value = dict(zip("RGB", RGB, strict=True))
    square = np.array([value[one] for one in order], np.uint8).reshape(2, 2)
    data, stride = packed(np.tile(square, (HEIGHT // 2, WIDTH // 2)), name)
    assert (of(data, name, stride) == RGB).all()


def test_the_colour_of_a_jpeg_is_that_of_its_grey_picture():
    scene = np.zeros((HEIGHT * 8, WIDTH * 8, 3), np.uint8)
    scene[:, : WIDTH * 4] = RGB
    scene[:, WIDTH * 4 :] = (30, 60, 220)
    data = cv2.imencode(".jpg", scene[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])[1].ravel()
    padded = np.concatenate([data, np.zeros(50, np.uint8)])
    for stream in (data, padded, data[:-2]):
        found = to_colour(
            stream, "MJPG", width_px=WIDTH * 8, height_px=HEIGHT * 8, bytes_per_line=0
        )
        assert found is not None
        assert np.abs(found[:, 8:40].astype(int) - RGB).max() <= 4
        assert np.abs(found[:, -40:-8].astype(int) - (30, 60, 220)).max() <= 4


def test_what_has_no_colour_gives_none():
    grey = np.full((16, 16), 90, np.uint8)
    jpeg = cv2.imencode(".jpg", grey)[1].ravel()
    assert to_colour(jpeg, "MJPG", width_px=16, height_px=16, bytes_per_line=0) is None
    assert to_colour(grey.ravel(), "GREY", width_px=16, height_px=16, bytes_per_line=16) is None
    grey_only = {"GREY", "Y10", "Y12", "Y14", "Y16", "Y10P", "Y12P", "Y8I", "Y12I"}
    assert set(DECODERS) - set(COLOUR_READERS) == grey_only


@given(
    blob=st.binary(max_size=600),
    name=st.sampled_from(sorted(COLOUR_READERS)),
    width=st.integers(1, 40),
    height=st.integers(1, 20),
    stride=st.integers(0, 90),
)
@settings(max_examples=150)
def test_any_bytes_give_a_picture_or_are_refused(
    blob: bytes, name: str, width: int, height: int, stride: int
):
    data = np.frombuffer(blob, np.uint8)
    try:
        found = to_colour(data, name, width_px=width, height_px=height, bytes_per_line=stride)
    except PixelError:
        return
    assert found is not None
    assert found.shape == (height, width, 3)
    assert found.dtype == np.uint8
