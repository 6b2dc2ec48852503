"""Stored JPEG pictures that are damaged in the middle, which a decoder conceals."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_drivers.jpeg.header import JpegDamageError, read_header
from rig_drivers.jpeg.scan import walk_scan
from rig_drivers.jpeg.whole import require_whole
from rig_drivers.stored.picture import read_picture

from benchmarks.mjpg import KINDS, coded, scene
from rig.errors import DeviceLostError


@cache
def shown() -> np.ndarray:
    return scene(5)


def stored(*options: int, kind: int = 0) -> bytes:
    if options:
        return cv2.imencode(".jpg", shown(), options)[1].tobytes()
    return coded(shown(), *KINDS[kind][1:]).tobytes()


def test_damage_that_a_decoder_conceals_is_told_with_the_file(tmp_path: Path):
    data = bytearray(stored())
    data[len(data) // 2 : len(data) // 2 + 40] = bytes(range(100, 140))
    concealed = cv2.imdecode(np.frombuffer(bytes(data), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert concealed is not None
    path = tmp_path / "left_7.jpg"
    path.write_bytes(data)
    with pytest.raises(DeviceLostError, match=r"left_7\.jpg is damaged: .*; replace or remove it"):
        read_picture(path)


def test_half_a_picture_with_an_end_mark_is_told(tmp_path: Path):
    data = stored()
    path = tmp_path / "half.jpg"
    path.write_bytes(data[: len(data) // 2] + b"\xff\xd9")
    with pytest.raises(DeviceLostError, match=r"half\.jpg is damaged: pixels are missing"):
        read_picture(path)


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_whole_pictures_are_read(kind: int, tmp_path: Path):
    path = tmp_path / "whole.jpg"
    path.write_bytes(stored(kind=kind))
    grey, colour = read_picture(path)
    assert grey.shape == (480, 640)
    assert colour is not None


@pytest.mark.parametrize(
    "options",
    [
        (cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
        (cv2.IMWRITE_JPEG_OPTIMIZE, 1, cv2.IMWRITE_JPEG_QUALITY, 30),
        (cv2.IMWRITE_JPEG_RST_INTERVAL, 7),
    ],
)
def test_what_other_programs_write_passes(options: tuple[int, ...], tmp_path: Path):
    path = tmp_path / "other.jpg"
    path.write_bytes(stored(*options))
    assert read_picture(path)[0].shape == (480, 640)


def test_light_beyond_eight_bits_is_damage_of_a_camera_and_none_of_a_file():
    image = np.full((8, 8), 128, np.uint8)
    image[3, 3] = 255
    data = bytearray(cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, 100))[1].tobytes())
    at = data.index(b"\xff\xdb") + 5
    data[at : at + 64] = bytes([1] + [2] * 63)  # the pixel is decoded twice as bright
    content = bytes(data)
    require_whole(content)
    with pytest.raises(JpegDamageError, match="brighter, darker or rougher"):
        walk_scan(np.frombuffer(content, np.uint8), read_header(content))
