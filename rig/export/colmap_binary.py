"""The binary form of a COLMAP model, as the plain values of `rig.export.colmap_model`.

Little-endian, without padding. Counts come from the file: nothing is read or made for a count that
the file is too short for. Format: COLMAP documentation, "Output Format".
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rig.errors import FormatError
from rig.export import fields
from rig.export.colmap_model import (
    MODELS,
    MOST_CAMERAS,
    MOST_IMAGES,
    ColmapCamera,
    ColmapImage,
    unknown_model,
)
from rig.files import read_bytes

MOST_BYTES = 40_000_000
"""Nearly all of it points, which are passed over."""
_NAMES = (
    "SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE",
    "FULL_OPENCV", "FOV", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "THIN_PRISM_FISHEYE",
    "RAD_TAN_THIN_PRISM_FISHEYE", "SIMPLE_DIVISION", "DIVISION", "SIMPLE_FISHEYE", "FISHEYE",
)  # fmt: skip
"""By the numbers of the models."""
_BYTES_OF_A_POINT = 24


@dataclass(slots=True)
class _Cursor:
    """What is left of a file."""

    path: Path
    content: bytes
    at: int = 0

    def take(self, form: str) -> tuple[float, ...]:
        """Numbers of a layout; whole ones come as such."""
        size = struct.calcsize(f"<{form}")
        self.skip(size)
        return struct.unpack_from(f"<{form}", self.content, self.at - size)

    def whole(self, form: str) -> int:
        return int(self.take(form)[0])

    def skip(self, count: int) -> None:
        if self.at + count > len(self.content):
            raise FormatError(
                f"{self.path}: ends at byte {len(self.content)}, asked for {self.at + count}",
                advice="copy the file again, or export the model as text",
            )
        self.at += count

    def text(self) -> str:
        """A name up to the byte 0 that ends it."""
        end = self.content.find(b"\0", self.at)
        if end < 0:
            raise FormatError(f"{self.path}: a name does not end")
        raw, self.at = self.content[self.at : end], end + 1
        try:
            return raw.decode()
        except UnicodeDecodeError as error:
            raise FormatError(f"{self.path}: a name is no text") from error


def read_cameras(path: Path) -> dict[int, ColmapCamera]:
    """Return the cameras of a `cameras.bin` by their ids.

    Raises:
        FormatError: it is damaged, has more cameras than rigs have, or a model not known here.
        StoreError: it cannot be read.
    """
    return dict(_cameras(_open(path, MOST_CAMERAS, "cameras")))


def _cameras(file: tuple[_Cursor, int]) -> Iterator[tuple[int, ColmapCamera]]:
    cursor, count = file
    for _ in range(count):
        number, model = cursor.whole("I"), cursor.whole("i")
        where = f"{cursor.path}: camera {number}"
        name = _NAMES[model] if 0 <= model < len(_NAMES) else f"number {model}"
        if name not in MODELS:  # how many numbers it has is not known either
            raise unknown_model(name, where)
        width, height = (fields.size_px(cursor.whole("Q"), where) for _ in range(2))
        parameters = fields.numbers(cursor.take(f"{MODELS[name].count}d"), where)
        yield number, ColmapCamera(name, width, height, parameters)


def read_images(path: Path) -> list[ColmapImage]:
    """Return the images of an `images.bin`, in its order, without their points.

    Raises:
        FormatError: it is damaged, or has more images than rigs have.
        StoreError: it cannot be read.
    """
    cursor, count = _open(path, MOST_IMAGES, "images")
    images: list[ColmapImage] = []
    for _ in range(count):
        number = cursor.whole("I")
        placed = fields.numbers(cursor.take("7d"), f"{path}: image {number}")
        camera, name = cursor.whole("I"), cursor.text()
        cursor.skip(cursor.whole("Q") * _BYTES_OF_A_POINT)
        images.append(ColmapImage(name, camera, placed[:4], placed[4:]))
    return images


def _open(path: Path, most: int, what: str) -> tuple[_Cursor, int]:
    content = read_bytes(path, most=MOST_BYTES)
    if len(content) > MOST_BYTES:
        raise FormatError(
            f"{path}: larger than {MOST_BYTES / 1e6:g} MB",
            advice="export the images of one instant, one per view",
        )
    cursor = _Cursor(path, content)
    count = cursor.whole("Q")
    if count > most:
        raise FormatError(
            f"{path}: says that it holds {count} {what}, rigs have {most} views at most",
            advice="export the images of one instant, one per view",
        )
    return cursor, count
