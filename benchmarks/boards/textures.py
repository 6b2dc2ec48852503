"""Drawings that are no board: what hangs on walls, lies on desks and covers floors."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
_SIDE = 720
_WORDS = ("offset", "gain", "Kalibrierung", "shelf 4", "do not open", "lens", "1 2 3 5 8", "EXIT")


def _grey(random: np.random.Generator, low: int = 20, high: int = 235) -> int:
    return int(random.integers(low, high))


def _canvas(grey: int) -> Image:
    return np.full((_SIDE, _SIDE), grey, np.uint8)


def clouds(random: np.random.Generator) -> Image:
    """Noise of several scales: plaster, carpet, leaves."""
    total = np.zeros((_SIDE, _SIDE), np.float32)
    for octave in range(2, 8):
        coarse = random.standard_normal((2**octave, 2**octave)).astype(np.float32)
        total += cv2.resize(coarse, (_SIDE, _SIDE), interpolation=cv2.INTER_CUBIC) / octave
    return np.clip(128 + random.uniform(15, 70) * total, 0, 255).astype(np.uint8)


def tiles(random: np.random.Generator) -> Image:
    """Tiles and joints; some are of another grey."""
    pitch, joint = int(random.integers(24, 90)), int(random.integers(1, 8))
    picture, base = _canvas(_grey(random)), _grey(random)
    spread = int(random.integers(1, 90))
    for y in range(0, _SIDE, pitch):
        for x in range(0, _SIDE, pitch):
            grey = int(np.clip(base + random.integers(-spread, spread + 1), 0, 255))
            picture[y : y + pitch - joint, x : x + pitch - joint] = grey
    return picture


def keyboard(random: np.random.Generator) -> Image:
    """Rows of keys, each moved against the last, with a letter on every one."""
    picture = _canvas(_grey(random, 10, 90))
    pitch, cap = int(random.integers(44, 80)), _grey(random, 60, 240)
    for row, y in enumerate(range(0, _SIDE, pitch)):
        for x in range(-int(pitch * 0.27 * row) % pitch - pitch, _SIDE, pitch):
            cv2.rectangle(picture, (x + 4, y + 4), (x + pitch - 5, y + pitch - 5), cap, -1)
            letter = chr(int(random.integers(65, 91)))
            ink = 255 - cap
            cv2.putText(picture, letter, (x + 9, y + pitch // 2), 0, pitch / 90, ink, 1)
    return picture


def windows(random: np.random.Generator) -> Image:
    """A facade: panes with frames and crossbars, light or dark within."""
    picture = _canvas(_grey(random))
    across, down = int(random.integers(50, 120)), int(random.integers(60, 140))
    frame, bar = _grey(random), int(random.integers(2, 7))
    for y in range(10, _SIDE - down, down):
        for x in range(10, _SIDE - across, across):
            picture[y : y + down - 16, x : x + across - 14] = frame
            half_x, half_y = (across - 14) // 2, (down - 16) // 2
            for i in (0, 1):
                for j in (0, 1):
                    top, left = y + j * half_y + bar, x + i * half_x + bar
                    picture[top : top + half_y - 2 * bar, left : left + half_x - 2 * bar] = _grey(
                        random
                    )
    return picture


def books(random: np.random.Generator) -> Image:
    """Spines side by side on shelves, with titles."""
    picture = _canvas(_grey(random, 10, 70))
    shelf = int(random.integers(120, 240))
    for y in range(0, _SIDE, shelf):
        x = 0
        while x < _SIDE:
            wide, high = int(random.integers(12, 48)), int(shelf * random.uniform(0.6, 0.93))
            grey = _grey(random)
            picture[y + shelf - high : y + shelf - 6, x : x + wide - 1] = grey
            for stripe in random.integers(y + shelf - high, y + shelf - 8, 3):
                picture[stripe : stripe + 4, x : x + wide - 1] = 255 - grey
            x += wide
    return picture


def bricks(random: np.random.Generator) -> Image:
    """A wall in stretcher bond."""
    picture = _canvas(_grey(random, 120, 235))
    high, joint = int(random.integers(20, 50)), int(random.integers(2, 7))
    wide, base = int(high * random.uniform(1.8, 3.2)), _grey(random, 20, 140)
    for row, y in enumerate(range(0, _SIDE, high)):
        for x in range(-(row % 2) * wide // 2, _SIDE, wide):
            grey = int(np.clip(base + random.integers(-25, 26), 0, 255))
            picture[y : y + high - joint, max(x, 0) : max(x + wide - joint, 0)] = grey
    return picture


def chess(random: np.random.Generator) -> Image:
    """A floor of two kinds of tiles, larger than any board asked for; joints or none."""
    pitch, joint = int(random.integers(22, 46)), int(random.integers(0, 3))
    y, x = np.mgrid[:_SIDE, :_SIDE]
    dark, light = _grey(random, 5, 90), _grey(random, 140, 250)
    picture = np.where((y // pitch + x // pitch) % 2 == 0, dark, light).astype(np.uint8)
    if joint:
        picture[(y % pitch < joint) | (x % pitch < joint)] = _grey(random)
    return picture


def small_chess(random: np.random.Generator) -> Image:
    """A game or a rug of 12 x 13 squares with a rim: whole, but of no count asked for."""
    pitch = int(random.integers(30, 48))
    picture = _canvas(_grey(random))
    rows, columns = (12, 13) if random.random() < 0.5 else (13, 14)
    y, x = np.mgrid[: rows * pitch, : columns * pitch]
    dark, light = _grey(random, 5, 90), _grey(random, 140, 250)
    squares = np.where((y // pitch + x // pitch) % 2 == 0, dark, light)
    rim = int(random.integers(0, 30))
    picture[20 : 20 + rows * pitch + 2 * rim, 20 : 20 + columns * pitch + 2 * rim] = light
    picture[20 + rim : 20 + rim + rows * pitch, 20 + rim : 20 + rim + columns * pitch] = squares
    return picture


def text(random: np.random.Generator) -> Image:
    """A page of words."""
    picture = _canvas(_grey(random, 190, 255))
    size, y = float(random.uniform(0.4, 1.2)), 20
    while y < _SIDE:
        line = "  ".join(random.choice(_WORDS, 12))
        cv2.putText(picture, line, (8, y), int(random.integers(0, 5)), size, 30, 1, cv2.LINE_AA)
        y += int(34 * size)
    return picture


def dots(random: np.random.Generator) -> Image:
    """Rows of discs or squares: perforated plates, loudspeakers."""
    picture, ink = _canvas(_grey(random, 120, 255)), _grey(random, 0, 100)
    pitch = int(random.integers(14, 50))
    radius, square = max(3, int(pitch * random.uniform(0.25, 0.45))), random.random() < 0.5
    for row, y in enumerate(range(pitch, _SIDE, pitch)):
        for x in range(pitch + (row % 2) * int(random.integers(0, 2)) * pitch // 2, _SIDE, pitch):
            if square:
                cv2.rectangle(picture, (x - radius, y - radius), (x + radius, y + radius), ink, -1)
            else:
                cv2.circle(picture, (x, y), radius, ink, -1, cv2.LINE_AA)
    return picture


def plaid(random: np.random.Generator) -> Image:
    """Cloth: stripes of two directions laid over each other."""
    waves = [np.repeat(random.uniform(0.2, 1, 60), random.integers(6, 40)) for _ in (0, 1)]
    one, two = (np.resize(wave, _SIDE) for wave in waves)
    return (250 * (one[:, None] + two[None]) / 2).astype(np.uint8)


def bits(random: np.random.Generator) -> Image:
    """Black and white cells at random: codes, labels, crosswords."""
    cells = int(random.integers(14, 40))
    code = np.where(random.random((cells, cells)) < random.uniform(0.35, 0.65), 20, 230)
    return cv2.resize(
        code.astype(np.uint8), (_SIDE, _SIDE), interpolation=cv2.INTER_NEAREST
    ).astype(np.uint8)


def parquet(random: np.random.Generator) -> Image:
    """Blocks of boards, turned in turns."""
    block, strips = int(random.integers(60, 120)), int(random.integers(3, 6))
    picture, base = _canvas(128), _grey(random, 60, 180)
    for j, y in enumerate(range(0, _SIDE, block)):
        for i, x in enumerate(range(0, _SIDE, block)):
            piece = picture[y : y + block, x : x + block]
            piece = piece if (i + j) % 2 else piece.T
            for s in range(strips):
                low, high = s * block // strips, (s + 1) * block // strips - 1
                piece[low:high] = int(np.clip(base + random.integers(-60, 61), 0, 255))
    return picture


def markers(random: np.random.Generator) -> Image:
    """Single markers on paper, on no board."""
    picture = _canvas(235)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    pitch = int(random.integers(70, 150))
    side = int(pitch * random.uniform(0.5, 0.9))
    for y in range(10, _SIDE - pitch, pitch):
        for x in range(10, _SIDE - pitch, pitch):
            number = int(random.integers(0, 50))
            drawn = cv2.aruco.generateImageMarker(dictionary, number, side)
            picture[y : y + side, x : x + side] = drawn
    return picture


TEXTURES: dict[str, Callable[[np.random.Generator], Image]] = {
    kind.__name__: kind
    for kind in (
        clouds, tiles, keyboard, windows, books, bricks, chess, small_chess, text, dots, plaid,
        bits, parquet, markers,
    )
}  # fmt: skip
