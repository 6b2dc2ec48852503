"""One stored picture: its grey values, and its colour where it has some."""

from pathlib import Path
from typing import TypeAlias, cast

import cv2
import numpy as np

from rig.errors import DeviceLostError
from rig.frames import ColourImage, GreyImage
from rig.pictures import PictureError, decoded
from rig_drivers.stored.lytro import is_lytro, lytro_raw

Picture: TypeAlias = tuple[GreyImage, ColourImage | None]
"""Grey values, and the colour that they were made of."""
_NAME = "camera folder"
_JPEG = b"\xff\xd8"
_DEPTHS = ("uint8", "uint16")


def read_picture(path: Path) -> Picture:
    """Read PNG, JPEG, TIFF, PGM and the like as grey, 8 or 16 bit as stored, and its colour.

    A raw picture of a Lytro camera is read as its pixels are, behind their colour filters.

    Raises:
        DeviceLostError: it cannot be read, or is no such picture.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DeviceLostError(
            _NAME, f"{path} cannot be read: {error.strerror}", advice="check permissions and disk"
        ) from error
    raw = np.frombuffer(data, np.uint8)
    if is_lytro(path, raw):
        return lytro_raw(path, raw), None
    try:
        image = decoded(data)
    except PictureError as error:
        raise DeviceLostError(
            _NAME,
            f"{path} is no image or is damaged: it {error}",
            advice="replace or remove it",
        ) from error
    _require_whole(path, data)
    if image.dtype.name not in _DEPTHS:
        raise DeviceLostError(_NAME, f"{path} holds {image.dtype}", advice="8 or 16 bit is needed")
    found = cast("GreyImage", image)
    if found.ndim == 2:
        return found, None
    has_alpha = found.shape[2] == 4
    code = cv2.COLOR_BGRA2GRAY if has_alpha else cv2.COLOR_BGR2GRAY
    return cast("GreyImage", cv2.cvtColor(found, code)), _in_colour(found[..., :3])


def _require_whole(path: Path, data: bytes) -> None:
    """Refuse a JPEG in which the decoder has filled in what it could not read."""
    if not data.startswith(_JPEG):
        return
    from rig_drivers.jpeg.header import JpegDamageError  # compiles machine code
    from rig_drivers.jpeg.whole import require_whole

    try:
        require_whole(data)
    except JpegDamageError as error:
        raise DeviceLostError(
            _NAME, f"{path} is damaged: {error}", advice="replace or remove it"
        ) from error


def read_grey(path: Path) -> GreyImage:
    """Read a picture as `read_picture` does, without its colour."""
    return read_picture(path)[0]


def _in_colour(bgr: GreyImage) -> ColourImage:
    """Red, green and blue of 8 bits; the upper ones of 16."""
    top = bgr if bgr.dtype == np.uint8 else bgr >> 8
    return np.ascontiguousarray(top[..., ::-1], np.uint8)
