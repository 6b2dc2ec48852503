"""Pictures from outside: read as OpenCV reads them, or refused before they cost anything."""

import struct
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.pictures import MOST_BYTES, PictureError, decoded
from rig.pictures.size import MOST_SIDE_PX, require_size

PNG = b"\x89PNG\r\n\x1a\n"
GREY = np.arange(5 * 7, dtype=np.uint8).reshape(5, 7)
COLOUR = np.dstack([GREY, GREY[::-1], GREY[:, ::-1]])
KINDS = {
    "grey.png": (".png", GREY),
    "deep.png": (".png", GREY.astype(np.uint16) * 1000),
    "colour.png": (".png", COLOUR),
    "opacity.png": (".png", np.dstack([COLOUR, GREY])),
    "grey.jpg": (".jpg", GREY),
    "colour.jpg": (".jpg", COLOUR),
    "grey.tiff": (".tiff", GREY),
    "deep.tiff": (".tiff", GREY.astype(np.uint16) * 1000),
    "grey.pgm": (".pgm", GREY),
    "deep.pgm": (".pgm", GREY.astype(np.uint16) * 1000),
    "colour.ppm": (".ppm", COLOUR),
    "grey.bmp": (".bmp", GREY),
    "colour.webp": (".webp", COLOUR),
}


def encoded(suffix: str, image: np.ndarray) -> bytes:
    done, content = cv2.imencode(suffix, image)
    assert done
    return content.tobytes()


def part(name: bytes, body: bytes, *, checksum: int | None = None) -> bytes:
    found = zlib.crc32(name + body) if checksum is None else checksum
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", found)


def png(
    width: int,
    height: int,
    pixels: bytes,
    *,
    bits: int = 8,
    colour: int = 0,
    interlace: int = 0,
    more: bytes = b"",
) -> bytes:
    head = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, interlace)
    return PNG + part(b"IHDR", head) + more + part(b"IDAT", pixels) + part(b"IEND", b"")


@pytest.mark.parametrize("name", KINDS)
def test_every_format_comes_back_as_it_is_stored(name: str):
    suffix, image = KINDS[name]
    content = encoded(suffix, image)
    found = decoded(content)
    wanted = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert wanted is not None
    np.testing.assert_array_equal(found, wanted)
    assert found.dtype == image.dtype
    if suffix in {".png", ".tiff", ".pgm", ".ppm"}:
        np.testing.assert_array_equal(found, image)


def test_an_interlaced_png_is_read():
    # Two rows, two columns: passes 1 (1 x 1), 6 (1 x 1) and 7 (2 x 1) have pixels.
    rows = bytes([0, 10, 0, 20, 0, 30, 40])
    found = decoded(png(2, 2, zlib.compress(rows), interlace=1))
    np.testing.assert_array_equal(found, [[10, 20], [30, 40]])


@pytest.mark.parametrize(
    ("width", "height", "pixel_bytes", "is_read"),
    [
        (MOST_SIDE_PX, 1, 1, True),
        (MOST_SIDE_PX + 1, 1, 1, False),
        (1, MOST_SIDE_PX + 1, 1, False),
        (0, 1, 1, False),
        (1, 0, 1, False),
        (15_000, 10_000, 1, True),
        (15_000, 10_001, 1, False),
        (15_000, 5_001, 2, False),
    ],
)
def test_the_largest_picture_is_counted_in_bytes(
    width: int, height: int, pixel_bytes: int, is_read: bool
):
    assert MOST_BYTES == 150_000_000
    if is_read:
        require_size(width, height, pixel_bytes)
        assert width * height * pixel_bytes <= MOST_BYTES
    else:
        with pytest.raises(PictureError, match=f"claims {width} x {height} px"):
            require_size(width, height, pixel_bytes)


def tiff_of(width: int, height: int) -> bytes:
    fields = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, 8), (277, 3, 1, 1)]
    directory = struct.pack("<H", len(fields)) + b"".join(struct.pack("<HHII", *f) for f in fields)
    return b"II*\x00" + struct.pack("<I", 8) + directory + bytes(4)


HUGE = {
    "png": png(65535, 65535, zlib.compress(b"")),
    "deep png": png(20000, 20000, zlib.compress(b""), bits=16, colour=6),
    "jpeg": b"\xff\xd8\xff\xc0\x00\x0b\x08\xff\xff\xff\xff\x01\x01\x11\x00\xff\xda\xff\xd9",
    "progressive jpeg": b"\xff\xd8\xff\xc2\x00\x0b\x08\x20\x00\x20\x00\x01" + b"\xff\xda\xff\xd9",
    "tiff": tiff_of(65535, 65535),
    "pgm": b"P5\n# a comment\n65535 65535\n255\n",
    "bitmap": b"BM" + bytes(12) + struct.pack("<Iii", 40, 65535, -65535),
    "webp": b"RIFF\x00\x00\x00\x00WEBPVP8L\x00\x00\x00\x00\x2f" + b"\xff" * 9,
}


@pytest.mark.parametrize("name", HUGE)
def test_what_claims_to_be_huge_costs_nothing(name: str):
    tracemalloc.start()
    try:
        with pytest.raises(PictureError, match=r"px, which take \d+ MB, most are 150 MB"):
            decoded(HUGE[name])
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 100_000


ROWS = zlib.compress(bytes([0, 1, 2, 0, 3, 4]))
DAMAGED_PNG = {
    "no header": (PNG + part(b"IEND", b""), "has no header"),
    "two headers": (
        png(2, 2, ROWS, more=part(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 0, 0, 0, 0))),
        "has two headers",
    ),
    "depth": (png(2, 2, ROWS, bits=3), "has a header that no PNG has"),
    "colour": (png(2, 2, ROWS, colour=5), "has a header that no PNG has"),
    "interlace": (png(2, 2, ROWS, interlace=2), "has a header that no PNG has"),
    "checksum": (
        png(2, 2, ROWS, more=part(b"tEXt", b"a", checksum=1)),
        "is damaged: the checksum of a part b'tEXt' is wrong",
    ),
    "cut": (png(2, 2, ROWS)[:-20], "is cut off"),
    "long part": (PNG + struct.pack(">I4s", 1 << 30, b"IHDR") + bytes(13), "is cut off"),
    "few pixels": (png(2, 3, ROWS), "6 bytes of pixels where 9 belong"),
    "many pixels": (png(2, 1, ROWS), "more than the 3 bytes"),
    "cut pixels": (png(2, 2, ROWS[:-3]), "is damaged"),
    "no stream": (png(2, 2, b"abc"), "is damaged"),
    "filter": (
        png(2, 2, zlib.compress(bytes([0, 1, 2, 5, 3, 4]))),
        "is damaged: a row is coded in no known way",
    ),
    "palette": (png(2, 2, ROWS, colour=3), "has no palette"),
    "short palette": (
        png(2, 2, ROWS, colour=3, more=part(b"PLTE", bytes(4))),
        "has a palette that no PNG has",
    ),
}


@pytest.mark.parametrize("name", DAMAGED_PNG)
def test_a_damaged_png_is_told_without_a_word_of_the_decoder(
    name: str, capfd: pytest.CaptureFixture[str]
):
    content, told = DAMAGED_PNG[name]
    with pytest.raises(PictureError) as refused:
        decoded(content)
    assert told in str(refused.value)
    assert capfd.readouterr().err == ""


def test_what_a_png_does_not_need_is_not_unpacked():
    bomb = zlib.compress(bytes(5_000_000))
    content = png(2, 2, ROWS, more=part(b"zTXt", b"a\0\0" + bomb) + part(b"iCCP", b"a\0\0" + bomb))
    np.testing.assert_array_equal(decoded(content), [[1, 2], [3, 4]])


BROKEN = {
    "empty": (b"", "is empty"),
    "text": (b"not an image", "is no image of a known format"),
    "jpeg without a size": (b"\xff\xd8\xff\xe0\x00\x02\xff\xd9\xff\xff\xd9", "its size is missing"),
    "jpeg without marks": (b"\xff\xd8" + bytes(9), "no mark where one belongs"),
    "jpeg cut in its size": (b"\xff\xd8\xff\xc0\x00\x0b\x08", "is cut off"),
    "jpeg without an end": (encoded(".jpg", GREY)[:-2], "its end is missing"),
    "jpeg of many scans": (
        HUGE["jpeg"][:7] + b"\x00\x02\x00\x02" + HUGE["jpeg"][11:] + b"\xff\xda" * 100,
        "has 101 scans, most are 100",
    ),
    "tiff without a directory": (b"II*\x00\xff\xff\xff\xff", "is cut off"),
    "tiff without a size": (b"II*\x00\x08\x00\x00\x00\x00\x00", "its size is missing"),
    "tiff of nothing": (tiff_of(3, 3), "the decoder refuses it"),
    "pgm without a size": (b"P5\nwide\n", "no header of width and height"),
    "pgm cut": (b"P5 7 5 255\n" + bytes(34), "34 bytes of pixels where 35 belong"),
    "deep pgm cut": (b"P5 7 5 256\n" + bytes(69), "69 bytes of pixels where 70 belong"),
    "bitmap cut": (b"BM" + bytes(23), "is cut off"),
    "webp cut": (b"RIFF" + bytes(25), "is cut off"),
    "webp of sounds": (b"RIFF" + bytes(26), "is no still picture"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_every_other_damage_is_told(name: str):
    content, told = BROKEN[name]
    with pytest.raises(PictureError) as refused:
        decoded(content)
    assert told in str(refused.value)


@given(
    suffix=st.sampled_from([".png", ".jpg", ".tiff", ".pgm", ".bmp", ".webp"]),
    changes=st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), max_size=6),
    cut=st.integers(0, 400),
)
def test_any_change_makes_a_picture_or_one_reason(
    suffix: str, changes: list[tuple[int, int]], cut: int
):
    content = bytearray(encoded(suffix, GREY))
    for place, value in changes:
        content[place % len(content)] = value
    try:
        found = decoded(bytes(content[: len(content) - cut % 9]))
    except PictureError as error:
        assert "\n" not in str(error)
    else:
        assert found.nbytes <= MOST_BYTES
