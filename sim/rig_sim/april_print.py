"""What Kalibr prints on an AprilGrid."""

import cv2
import numpy as np

from rig.errors import ConfigError
from rig.profile import AprilGridConfig
from rig_sim.board import Print

_BITS = 6
_MOST_PARTS = 8


def april_print(config: AprilGridConfig) -> Print:
    """Return the texels of an AprilGrid, outer small squares included.

    Raises:
        ConfigError: tags and gaps share no grid, or there are not so many tags.
    """
    parts = _parts(config)
    side = (_BITS + 2 * config.border_bits) * parts
    gap = round(config.spacing * side)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    if config.first_tag + config.tag_columns * config.tag_rows > len(dictionary.bytesList):
        raise ConfigError(
            f"target: {config.tag_columns} x {config.tag_rows} tags from {config.first_tag} on, "
            f"there are {len(dictionary.bytesList)}",
            advice="use fewer",
        )
    step = side + gap
    ink = np.zeros((config.tag_rows * step + gap, config.tag_columns * step + gap), np.bool_)
    for row in range(config.tag_rows + 1):
        for column in range(config.tag_columns + 1):
            ink[row * step : row * step + gap, column * step : column * step + gap] = True
    for row in range(config.tag_rows):
        for column in range(config.tag_columns):
            upwards = config.tag_rows - 1 - row
            number = config.first_tag + upwards * config.tag_columns + column
            drawn = cv2.aruco.generateImageMarker(
                dictionary, number, side, borderBits=config.border_bits
            )
            top, left = gap + row * step, gap + column * step
            # Kalibr's tags are OpenCV's, half a turn around.
            ink[top : top + side, left : left + side] = np.rot90(np.asarray(drawn), 2) < 128
    return tuple("".join(".#"[dark] for dark in line) for line in ink.tolist())


def april_texel_mm(config: AprilGridConfig) -> float:
    """Return the side of one texel.

    Raises:
        ConfigError: tags and gaps share no grid.
    """
    return config.tag_mm / ((_BITS + 2 * config.border_bits) * _parts(config))


def _parts(config: AprilGridConfig) -> int:
    """Texels along a bit, so that the gap is a whole number of them."""
    bits = _BITS + 2 * config.border_bits
    for parts in range(1, _MOST_PARTS + 1):
        gap = config.spacing * bits * parts
        if abs(gap - round(gap)) < 1e-6 and round(gap) >= 1:
            return parts
    raise ConfigError(
        f"target.spacing = {config.spacing:g}: gaps and bits of {bits} across share no grid",
        advice="simulate one with a spacing of 0.3 or 0.25",
    )
