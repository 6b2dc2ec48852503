"""From the bytes of a file to pixels."""

from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.pictures.bitmap import BMP, WEBP, plain_bmp, plain_webp
from rig.pictures.jpeg import MAGIC as JPEG
from rig.pictures.jpeg import plain_jpeg
from rig.pictures.netpbm import MAGICS as NETPBM
from rig.pictures.netpbm import plain_netpbm
from rig.pictures.png import MAGIC as PNG
from rig.pictures.png import plain_png
from rig.pictures.size import PictureError
from rig.pictures.tiff import MAGICS as TIFF
from rig.pictures.tiff import plain_tiff

_READ: Final[tuple[tuple[bytes, Callable[[bytes], bytes]], ...]] = (
    (PNG, plain_png),
    (JPEG, plain_jpeg),
    *((magic, plain_tiff) for magic in TIFF),
    *((magic, plain_netpbm) for magic in NETPBM),
    (BMP, plain_bmp),
    (WEBP, plain_webp),
)

# What it has to say is an exception of ours; a line on the terminal is nobody's.
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)


def decoded(content: bytes) -> NDArray[np.generic]:
    """Return the pixels of a picture as OpenCV orders them, of the depth that is stored.

    Args:
        content: a whole file: PNG, JPEG, TIFF, PBM, PGM, PPM, BMP or WebP.

    Returns:
        (H, W) or (H, W, 3) or (H, W, 4), blue first.

    Raises:
        PictureError: it is none of these, is damaged, or claims a size that no picture has.
    """
    for magic, plain in _READ:
        if content.startswith(magic):
            return _pixels(plain(content))
    raise PictureError("is empty" if not content else "is no image of a known format")


def _pixels(content: bytes) -> NDArray[np.generic]:
    try:
        image: NDArray[np.generic] | None = cv2.imdecode(
            np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED
        )
    except cv2.error as error:
        raise PictureError("is damaged: the decoder refuses it") from error
    if image is None:
        raise PictureError("is damaged: the decoder refuses it")
    if image.ndim != 2 and image.shape[2:] not in ((3,), (4,)):
        raise PictureError(f"has {image.shape[2]} channels, pictures have 1, 3 or 4")
    return image
