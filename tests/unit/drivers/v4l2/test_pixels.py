"""Bytes of a buffer as a grey image."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.v4l2.pixels import DECODERS, PixelError, to_grey

JPEGS = {"MJPG", "JPEG"}
RNG = np.random.default_rng(3)
EIGHT = RNG.integers(0, 256, (6, 10), np.uint8)


def with_padding(lines: np.ndarray, padding: int) -> np.ndarray:
    raw = np.ascontiguousarray(lines).view(np.uint8)
    return np.pad(raw, ((0, 0), (0, padding)), constant_values=0xAA).ravel()


@pytest.mark.parametrize("padding", [0, 6])
def test_grey(padding: int):
    data = with_padding(EIGHT, padding)
    image = to_grey(data, "GREY", width_px=10, height_px=6, bytes_per_line=10 + padding)
    assert np.array_equal(image, EIGHT)
    assert image.base is None


@pytest.mark.parametrize("padding", [0, 6])
@pytest.mark.parametrize(("name", "bits"), [("Y10", 10), ("Y12", 12), ("Y14", 14), ("Y16", 16)])
def test_deep_formats_keep_the_counts_of_the_sensor(name: str, bits: int, padding: int):
    counts = RNG.integers(0, 1 << bits, (6, 10)).astype("<u2")
    data = with_padding(counts, padding)
    image = to_grey(data, name, width_px=10, height_px=6, bytes_per_line=20 + padding)
    assert image.dtype == np.uint16
    assert np.array_equal(image, counts)
    assert DECODERS[name][1] == bits


def test_yuyv_gives_its_luma():
    packed = np.full((6, 10, 2), 128, np.uint8)
    packed[..., 0] = EIGHT
    data = with_padding(packed.reshape(6, 20), 4)
    image = to_grey(data, "YUYV", width_px=10, height_px=6, bytes_per_line=24)
    assert np.array_equal(image, EIGHT)
    colour = cv2.cvtColor(packed, cv2.COLOR_YUV2BGR_YUYV)  # an independent reader: same order
    assert np.corrcoef(colour[..., 1].ravel(), EIGHT.ravel())[0, 1] > 0.99


@pytest.mark.parametrize("name", ["NV12", "NV21", "NV16", "NV61", "YU12", "YV12"])
def test_a_plane_of_luma_comes_before_those_of_colour(name: str):
    chroma = np.full((3, 12), 128, np.uint8)
    data = np.concatenate([with_padding(EIGHT, 2), chroma.ravel()])
    image = to_grey(data, name, width_px=10, height_px=6, bytes_per_line=12)
    assert np.array_equal(image, EIGHT)


def jpeg() -> np.ndarray:
    smooth = np.add.outer(np.arange(48), np.arange(64)).astype(np.uint8)
    return cv2.imencode(".jpg", smooth, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].ravel()


def test_motion_jpeg_may_be_followed_by_zeros():
    data = np.concatenate([jpeg(), np.zeros(100, np.uint8)])
    image = to_grey(data, "MJPG", width_px=64, height_px=48, bytes_per_line=0)
    expected = np.add.outer(np.arange(48), np.arange(64))
    assert np.abs(image.astype(int) - expected).max() <= 3


@pytest.mark.parametrize(
    "data",
    [
        jpeg()[:-40],
        jpeg()[10:],
        np.zeros(0, np.uint8),
        np.frombuffer(b"\xff\xd8\xff\xd9", np.uint8),
    ],
    ids=["cut off", "no start", "nothing", "empty picture"],
)
def test_half_a_jpeg_is_no_picture(data: np.ndarray):
    with pytest.raises(PixelError):
        to_grey(data, "MJPG", width_px=64, height_px=48, bytes_per_line=0)


def test_a_jpeg_of_another_size_is_refused():
    with pytest.raises(PixelError, match="64 x 48 px, agreed were 32 x 48"):
        to_grey(jpeg(), "MJPG", width_px=32, height_px=48, bytes_per_line=0)


@pytest.mark.parametrize("name", ["GREY", "Y10", "YUYV", "NV12"])
def test_a_short_buffer_is_no_picture(name: str):
    with pytest.raises(PixelError, match="needed for 6 lines"):
        to_grey(np.zeros(50, np.uint8), name, width_px=10, height_px=6, bytes_per_line=20)


blobs = st.binary(max_size=600)


@given(
    blob=blobs,
    name=st.sampled_from([name for name in DECODERS if name not in JPEGS]),
    width=st.integers(1, 40),
    height=st.integers(1, 20),
    stride=st.integers(0, 90),
)
@settings(max_examples=300)
def test_any_bytes_give_an_image_or_are_refused(
    blob: bytes, name: str, width: int, height: int, stride: int
):
    data = np.frombuffer(blob, np.uint8)
    try:
        image = to_grey(data, name, width_px=width, height_px=height, bytes_per_line=stride)
    except PixelError:
        return
    assert image.shape == (height, width * (2 if name in {"Y8I", "Y12I"} else 1))


@given(cut=st.integers(0, 600), at=st.integers(0, 600), value=st.integers(0, 255))
@settings(max_examples=100)
def test_any_damaged_jpeg_gives_an_image_or_is_refused(cut: int, at: int, value: int):
    data = jpeg().copy()
    data[at % data.size] = value
    data = data[: max(1, data.size - cut)]
    try:
        image = to_grey(data, "MJPG", width_px=64, height_px=48, bytes_per_line=0)
    except PixelError:
        return
    assert image.shape == (48, 64)


@pytest.mark.slow
def test_100_000_damaged_buffers_give_images_or_are_refused():
    random = np.random.default_rng(17)
    good, refused = jpeg(), 0
    for number in range(100_000):
        name = tuple(DECODERS)[number % len(DECODERS)]
        if name in JPEGS:
            data = good.copy()
            data[random.integers(0, data.size, 3)] = random.integers(0, 256, 3)
            data = data[: random.integers(1, 2 * data.size)]
        else:
            data = np.zeros(random.integers(0, 14_000), np.uint8)
        stride = int(random.integers(0, 140))
        try:
            image = to_grey(data, name, width_px=64, height_px=48, bytes_per_line=stride)
        except PixelError:
            refused += 1
            continue
        # Two views side by side, where their pixels come in turn.
        assert image.shape == (48, 128 if name in {"Y8I", "Y12I"} else 64)
    assert 20_000 < refused < 95_000
