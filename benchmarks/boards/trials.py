"""One rendered picture per number: without a board, or with one through a wide lens."""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.boards.looks import Drawing, Float, Image, Lens, Plane, hung, looked_at, taken
from benchmarks.boards.textures import TEXTURES
from rig.targets import CharucoBoard
from rig.targets.charuco.board import DICTIONARIES
from rig.targets.checkerboard import Checkerboard

Board: TypeAlias = Checkerboard | CharucoBoard

CHECKERS = (
    Checkerboard(9, 6, 25.0),
    Checkerboard(8, 6, 25.0),
    Checkerboard(7, 7, 25.0),
    Checkerboard(11, 8, 25.0),
    Checkerboard(5, 4, 25.0),
)
CHARUCOS = (
    CharucoBoard(11, 8, 25.0, 18.75, "4X4_50"),
    CharucoBoard(8, 6, 25.0, 18.75, "4X4_50"),
    CharucoBoard(7, 5, 25.0, 18.75, "5X5_100"),
    CharucoBoard(10, 7, 25.0, 20.0, "4X4_100"),
)
SIZES = ((640, 480), (1280, 800), (640, 400))
LEAST_SIDE_PX = 7.0
"""Of every square of a checkerboard that counts as large enough, across its narrow way..."""
LEAST_BIT_PX = 1.5
"""...and of every bit of a ChArUco board's markers."""
_TEXELS = 24.0
_QUIET = 0.5
"""Paper around the outer squares, in squares."""


@dataclass(frozen=True)
class Trial:
    """A picture, what is asked of it, and what is true."""

    kind: str
    target: Board
    image: Image
    corners: Float | None = None
    """(rows * columns, 2) true places; None without the board that is asked for."""
    reasons: tuple[str, ...] = ()
    """Reasons that are right where nothing is found."""


def drawn(target: Board, dictionary: str | None = None) -> Drawing:
    """The board on its paper."""
    cells = int(_TEXELS)
    if isinstance(target, CharucoBoard):
        size = (target.squares_across, target.squares_down)
        names = cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary or target.dictionary])
        board = cv2.aruco.CharucoBoard(size, 1.0, target.marker_share, names)
        cells *= 2
        grey = np.asarray(board.generateImage((size[0] * cells, size[1] * cells)))
        if target.inverted:
            grey = 255 - grey
    else:
        y, x = np.mgrid[: (target.rows + 1) * cells, : (target.columns + 1) * cells] // cells
        grey = np.where((y + x) % 2 == 0, 0, 255).astype(np.uint8)
    quiet = int(_QUIET * cells)
    edge = 0 if isinstance(target, CharucoBoard) and target.inverted else 255
    paper = cv2.copyMakeBorder(
        grey, quiet, quiet, quiet, quiet, cv2.BORDER_CONSTANT, value=[edge, 0, 0, 0]
    )
    return Drawing((30 + paper * np.float32(0.7)).astype(np.uint8), float(cells))


def places(target: Board, ring: int = 0) -> Float:
    """(rows + 2 ring, columns + 2 ring, 2) corners about the board's middle, in squares."""
    row, column = np.mgrid[-ring : target.rows + ring, -ring : target.columns + ring]
    middle = np.array([target.columns - 1, target.rows - 1]) / 2
    return np.stack([column, row], axis=-1) - middle


def widths_px(lens: Lens, plane: Plane, target: Board) -> Float:
    """(rows, columns) width of the narrowest square at every corner, NaN beyond the lens."""
    grid = lens.shown(plane.points(places(target, ring=1)))
    right, down = np.diff(grid, axis=1)[:-1], np.diff(grid, axis=0)[:, :-1]
    area = np.abs(right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0])
    long = np.maximum(np.linalg.norm(right, axis=-1), np.linalg.norm(down, axis=-1))
    wide = area / long
    return np.min([wide[:-1, :-1], wide[1:, :-1], wide[:-1, 1:], wide[1:, 1:]], axis=0)


def narrowest_px(lens: Lens, plane: Plane, target: Board) -> float:
    """Width of the narrowest square, NaN where a part is beyond the lens."""
    return float(widths_px(lens, plane, target).min())


def inside(lens: Lens, xy_px: Float, border_px: float) -> np.ndarray:
    """Which points (..., 2) are in the picture, so far from its border."""
    limit = np.array([lens.width, lens.height]) - 1 - border_px
    return np.asarray(((xy_px >= border_px) & (xy_px <= limit)).all(axis=-1))


def large_enough(target: Board, side_px: Float) -> NDArray[np.bool_]:
    """Whether squares of that width can be found."""
    if isinstance(target, CharucoBoard):
        return side_px * target.marker_share / target.bits_across >= LEAST_BIT_PX
    return side_px >= LEAST_SIDE_PX


def some_lens(random: np.random.Generator, *, wide: bool) -> Lens:
    """A pinhole or nearly one; or a wide lens up to 170 degrees."""
    width, height = SIZES[int(random.choice(len(SIZES), p=(0.6, 0.2, 0.2)))]
    if wide:
        across = float(random.uniform(90, 170))
        return Lens(width, height, across, float(random.uniform(0.02, 0.5)))
    return Lens(width, height, float(random.uniform(45, 95)), float(random.uniform(0.5, 1.0)))


def some_plane(random: np.random.Generator, lens: Lens, *, tilt_deg: float) -> Plane:
    """Anywhere in the picture, at a distance that shows some squares."""
    half = lens.across_deg / 2
    towards = (float(random.uniform(0, 0.9) * half), float(random.uniform(0, 360)))
    tilt = (*random.uniform(-tilt_deg, tilt_deg, 2), float(random.uniform(-180, 180)))
    distance = float(np.exp(random.uniform(np.log(2.0), np.log(40.0))))
    return hung(towards, tuple(float(angle) for angle in tilt), distance)  # pyright: ignore


def clutter(random: np.random.Generator, lens: Lens) -> np.ndarray:
    """What is behind: smooth light, or a texture out of focus; no chess, which has a count."""
    kinds = [kind for name, kind in TEXTURES.items() if "chess" not in name]
    grey = kinds[int(random.integers(len(kinds)))](random)
    weak = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), float(random.uniform(4, 12)))
    contrast = float(random.uniform(0, 0.8))
    weak = 110 + contrast * (weak - 128)
    return cv2.resize(np.clip(weak, 0, 255), (lens.width, lens.height))


def picture(
    random: np.random.Generator,
    lens: Lens,
    *hangings: tuple[Drawing, Plane],
    blur_px: float | None = None,
    gain: float = 1.0,
    lift: float = 0.0,
) -> Image:
    """Taken by a camera of usual blur and noise."""
    fine = looked_at(lens, clutter(random, lens), lens.rays(), *hangings)
    blur_px = float(random.uniform(0.4, 1.0)) if blur_px is None else blur_px
    return taken(gain * fine + lift, blur_px, float(random.uniform(0.5, 4.0)), random)


def without_board(number: int, seed: int) -> tuple[Trial, Trial]:
    """A picture with a texture on one or two planes, asked for a board of either kind."""
    random = np.random.default_rng((seed, 1, number))
    kind = list(TEXTURES)[number % len(TEXTURES)]
    lens = some_lens(random, wide=random.random() < 0.3)
    hangings: list[tuple[Drawing, Plane]] = []
    for _ in range(1 + int(random.random() < 0.3)):
        half = lens.across_deg / 2
        towards = (float(random.uniform(0, 0.4) * half), float(random.uniform(0, 360)))
        tilt = (*random.uniform(-45, 45, 2), float(random.uniform(-180, 180)))
        plane = hung(towards, tuple(tilt), float(random.uniform(4, 30)))  # pyright: ignore
        hangings.append((Drawing(TEXTURES[kind](random), 40.0), plane))
    image = picture(random, lens, *hangings)
    checker = CHECKERS[number // len(TEXTURES) % len(CHECKERS)]
    charuco = CHARUCOS[number // len(TEXTURES) % len(CHARUCOS)]
    return Trial(kind, checker, image), Trial(kind, charuco, image)


def wide_board(number: int, seed: int, target: Board) -> Trial:
    """A board that is wholly visible and large enough through a lens of 90 to 170 degrees."""
    random = np.random.default_rng((seed, 2, number))
    while True:
        lens = some_lens(random, wide=True)
        plane = some_plane(random, lens, tilt_deg=50.0)
        outline = lens.shown(plane.points(places(target, ring=1)))
        if not inside(lens, outline, 3.0).all():
            continue
        if large_enough(target, widths_px(lens, plane, target)).all():
            break
    image = picture(random, lens, (drawn(target), plane))
    corners = lens.shown(plane.points(places(target))).reshape(-1, 2)
    return Trial(f"{lens.across_deg // 20 * 20:.0f} deg", target, image, corners)
