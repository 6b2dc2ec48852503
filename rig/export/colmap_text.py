"""The text form of a COLMAP model, as the plain values of `rig.export.colmap_model`."""

from pathlib import Path

from rig.bounded_text import read_text
from rig.errors import FormatError
from rig.export import fields
from rig.export.colmap_model import MOST_CAMERAS, MOST_IMAGES, ColmapCamera, ColmapImage

_ADVICE = "export the images of one instant, one per view"


def read_cameras(path: Path) -> dict[int, ColmapCamera]:
    """Return the cameras of a `cameras.txt` by their ids.

    Raises:
        FormatError: a line is not as it should be, or there are more than rigs have.
        StoreError: it cannot be read.
    """
    cameras: dict[int, ColmapCamera] = {}
    lines = read_text(path).splitlines()
    if len(lines) > MOST_CAMERAS:
        raise FormatError(
            f"{path}: has {len(lines)} lines, rigs have {MOST_CAMERAS} views at most",
            advice=_ADVICE,
        )
    for line in lines:
        words = line.split()
        if not words or line.startswith("#"):
            continue
        where = f"{path}: camera {words[0][:40]}"
        if len(words) < 4:
            raise FormatError(f"{where}: expected id, model, width, height and parameters")
        width, height = (fields.size_px(n, where) for n in _numbers(words[2:4], where))
        number = _whole(words[0], where)
        cameras[number] = ColmapCamera(words[1], width, height, _numbers(words[4:], where))
    return cameras


def read_images(path: Path) -> list[ColmapImage]:
    """Return the images of an `images.txt`, in its order.

    Raises:
        FormatError: a line is not as it should be, or there are more than rigs have.
        StoreError: it cannot be read.
    """
    # Every image has two lines, the second of which (its points) may be empty.
    lines = [line for line in read_text(path).splitlines() if not line.startswith("#")]
    if len(lines) > 2 * MOST_IMAGES + 1:
        raise FormatError(
            f"{path}: holds {len(lines) // 2} images, rigs have {MOST_IMAGES} views at most",
            advice=_ADVICE,
        )
    images: list[ColmapImage] = []
    for line in lines[::2]:
        words = line.split()
        if not words:
            continue
        where = f"{path}: image {words[0][:40]}"
        if len(words) < 10:
            raise FormatError(f"{where}: expected 10 fields, found {len(words)}")
        placed = _numbers(words[1:8], where)
        camera = _whole(words[8], where)
        images.append(ColmapImage(" ".join(words[9:]), camera, placed[:4], placed[4:]))
    return images


def _whole(word: str, where: str) -> int:
    if not (word.isascii() and word.isdecimal() and len(word) <= 20):
        raise FormatError(f"{where}: expected a whole number, found {word[:40]}")
    return int(word)


def _numbers(words: list[str], where: str) -> list[float]:
    try:
        return fields.numbers([float(word) for word in words], where)
    except ValueError as error:
        raise FormatError(f"{where}: expected numbers, found {' '.join(words)[:60]}") from error
