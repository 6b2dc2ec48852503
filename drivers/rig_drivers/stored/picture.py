"""One stored picture as grey values."""

from pathlib import Path
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.errors import DeviceLostError
from rig.frames import GreyImage
from rig_drivers.stored.lytro import is_lytro, lytro_raw

_NAME = "camera folder"
_DEPTHS = ("uint8", "uint16")


def read_grey(path: Path) -> GreyImage:
    """Read PNG, JPEG, TIFF, PGM and the like as grey, 8 or 16 bit as stored.

    A raw picture of a Lytro camera is read as its pixels are, behind their colour filters.

    Raises:
        DeviceLostError: it cannot be read, or is no such picture.
    """
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise DeviceLostError(
            _NAME, f"{path} cannot be read: {error.strerror}", advice="check permissions and disk"
        ) from error
    if is_lytro(path, data):
        return lytro_raw(path, data)
    image: NDArray[np.generic] | None = (
        cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    )
    if image is None:
        raise DeviceLostError(
            _NAME, f"{path} is no image or is damaged", advice="replace or remove it"
        )
    if image.dtype.name not in _DEPTHS:
        raise DeviceLostError(_NAME, f"{path} holds {image.dtype}", advice="8 or 16 bit is needed")
    grey = cast("GreyImage", image)
    if grey.ndim == 2:
        return grey
    has_alpha = grey.shape[2] == 4
    code = cv2.COLOR_BGRA2GRAY if has_alpha else cv2.COLOR_BGR2GRAY
    return cast("GreyImage", cv2.cvtColor(grey, code))
