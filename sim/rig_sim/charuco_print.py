"""What OpenCV prints on a ChArUco board."""

import cv2
import numpy as np

from rig.errors import ConfigError
from rig.profile import CharucoConfig
from rig_sim.board import Print

_MOST_TEXELS = 64


def charuco_print(config: CharucoConfig) -> Print:
    """Return the texels of a ChArUco board.

    Raises:
        ConfigError: no such dictionary, or markers whose bits share no grid with the squares.
    """
    number = getattr(cv2.aruco, f"DICT_{config.dictionary.upper().removeprefix('DICT_')}", None)
    if number is None:
        raise ConfigError(
            f"target.dictionary: OpenCV has no dictionary {config.dictionary}",
            advice="name one of OpenCV's",
        )
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    bits, share = dictionary.markerSize + 2, config.marker_mm / config.square_mm
    texels = next(
        (
            n
            for n in range(bits, _MOST_TEXELS)
            if _whole(n * share / bits) and _whole_margin(n, share)
        ),
        None,
    )
    if texels is None:
        raise ConfigError(
            f"target: markers of {config.marker_mm} mm with {bits} bits across in squares of "
            f"{config.square_mm} mm have no grid of under {_MOST_TEXELS} steps in common",
            advice="simulate one with marker_mm of 3/4 of square_mm",
        )
    size = (config.squares_across, config.squares_down)
    board = cv2.aruco.CharucoBoard(size, config.square_mm, config.marker_mm, dictionary)
    board.setLegacyPattern(config.legacy_pattern)
    drawn = np.asarray(board.generateImage((size[0] * texels, size[1] * texels)))
    ink = (drawn < 128) != config.inverted
    return tuple("".join(".#"[dark] for dark in row) for row in ink.tolist())


def _whole(value: float) -> bool:
    return abs(value - round(value)) < 1e-6 and round(value) >= 1


def _whole_margin(texels: int, share: float) -> bool:
    return _whole(texels * (1.0 - share) / 2.0)
