"""Raw pictures of Lytro cameras, in containers that this test writes; no real file was at hand."""

import hashlib
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from rig_drivers.stored.lytro import is_lytro, lytro_raw
from rig_drivers.stored.picture import read_grey

from rig.errors import DeviceLostError

HEAD = b"\x89LFP\r\n\x1a\n" + struct.pack(">II", 1, 0)


def section(content: bytes, letter: bytes = b"C"):
    """One section as bytes, and the reference by which others name it."""
    reference = "sha1-" + hashlib.sha1(content).hexdigest()  # noqa: S324
    head = b"\x89LF" + letter + b"\r\n\x1a\n" + struct.pack(">II", 0, len(content))
    whole = head + reference.encode().ljust(80, b"\0") + content
    return whole + bytes(-len(whole) % 16), reference


def packed(pixels: NDArray[np.uint16], bits: int):
    """Pixels (H, W) as a camera packs them."""
    flat = pixels.ravel().astype(np.uint32)
    if bits == 16:
        return flat.astype(">u2").tobytes()
    if bits == 12:
        first, second = flat[::2], flat[1::2]
        triple = [first >> 4, (first & 15) << 4 | second >> 8, second & 255]
        return np.stack(triple, axis=-1).astype(np.uint8).tobytes()
    four = flat.reshape(-1, 4)
    low = np.sum([(four[:, k] & 3) << 2 * k for k in range(4)], axis=0)
    return np.concatenate([four >> 2, low[:, None]], axis=1).astype(np.uint8).tobytes()


def first_camera(pixels: NDArray[np.uint16], bits: int = 12, **changed: object):
    """A container whose table names pixels and metadata apart, as the first camera's does."""
    height, width = pixels.shape
    picture, picture_ref = section(packed(pixels, bits))
    image = {
        "width": width,
        "height": height,
        "rawDetails": {"pixelPacking": {"endianness": "big", "bitsPerPixel": bits}},
        **changed,
    }
    meta, meta_ref = section(json.dumps({"image": image}).encode())
    frame = {"imageRef": picture_ref, "metadataRef": meta_ref}
    table, _ = section(json.dumps({"picture": {"frameArray": [{"frame": frame}]}}).encode(), b"M")
    return np.frombuffer(HEAD + table + meta + picture, np.uint8)


def second_camera(pixels: NDArray[np.uint16], bits: int = 10):
    """A container whose metadata hold the frames themselves, as the Illum's do."""
    height, width = pixels.shape
    picture, picture_ref = section(packed(pixels, bits))
    details = {
        "width": width,
        "height": height,
        "pixelPacking": {"endianness": "little", "bitsPerPixel": bits},
    }
    frame = {"frame": {"imageRef": picture_ref, "metadata": {"image": details}}}
    meta, _ = section(json.dumps({"frames": [frame]}).encode())
    return np.frombuffer(HEAD + meta + picture, np.uint8)


def some_pixels(bits: int, width: int = 8, height: int = 6):
    return np.random.default_rng(bits).integers(0, 1 << bits, (height, width), np.uint16)


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_pixels_come_back_from_the_first_cameras_container(tmp_path: Path, bits: int):
    pixels = some_pixels(bits)
    file = tmp_path / "picture.lfp"
    file.write_bytes(first_camera(pixels, bits).tobytes())

    assert np.array_equal(read_grey(file), pixels)


def test_pixels_come_back_from_the_second_cameras_container(tmp_path: Path):
    pixels = some_pixels(10)

    assert np.array_equal(lytro_raw(tmp_path / "a.lfr", second_camera(pixels)), pixels)


def test_two_pixels_of_12_bit_lie_in_three_bytes_the_high_ones_first(tmp_path: Path):
    pixels = np.array([[0xABC, 0x123]], np.uint16)

    assert packed(pixels, 12) == b"\xab\xc1\x23"
    assert lytro_raw(tmp_path / "a.lfp", first_camera(pixels)).tolist() == [[0xABC, 0x123]]


def test_bare_pixels_are_known_by_their_number(tmp_path: Path):
    data = np.zeros(3280 * 3280 * 3 // 2, np.uint8)
    data[:3] = (0xAB, 0xC1, 0x23)

    picture = lytro_raw(tmp_path / "a.raw", data)

    assert picture.shape == (3280, 3280)
    assert picture[0, :2].tolist() == [0xABC, 0x123]
    assert is_lytro(tmp_path / "a.RAW", data)
    assert not is_lytro(tmp_path / "a.png", data)
    assert not is_lytro(tmp_path / "a.raw", data[:-1])


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (first_camera(some_pixels(12))[:-60], r"a section of 72 bytes begins at byte \d+ of \d+"),
        (
            first_camera(some_pixels(12), width=80),
            "80 x 6 px of 12 bit take 720 bytes, it holds 72",
        ),
        (first_camera(some_pixels(12), width=10**9), "has 1000000000 x 6 px by its metadata"),
        (first_camera(some_pixels(12), rawDetails={}), "have None bits by its metadata"),
        (np.frombuffer(HEAD + section(b"{}")[0], np.uint8), "no metadata in it names"),
        (np.frombuffer(HEAD + b"rubbish of some length", np.uint8), "no section begins at byte 16"),
    ],
)
def test_damage_is_told(tmp_path: Path, data: NDArray[np.uint8], told: str):
    with pytest.raises(DeviceLostError, match=told):
        lytro_raw(tmp_path / "a.lfp", data)


@given(data=st.data())
def test_a_damaged_container_gives_a_picture_or_one_line(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
):
    whole = first_camera(some_pixels(12)).copy()
    for _ in range(data.draw(st.integers(1, 6))):
        whole[data.draw(st.integers(3, whole.size - 1))] = data.draw(st.integers(0, 255))
    cut = whole[: data.draw(st.integers(3, whole.size))]
    try:
        shape = lytro_raw(tmp_path_factory.getbasetemp() / "a.lfp", cut).shape
    except DeviceLostError as error:
        assert "\n" not in str(error)
    else:
        assert len(shape) == 2
