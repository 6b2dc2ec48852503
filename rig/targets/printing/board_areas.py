"""The ink of a board."""

from itertools import groupby

import numpy as np

from rig.targets import AprilGrid, CharucoBoard, CircleGrid, Target
from rig.targets.checkerboard import Checkerboard
from rig.targets.printing.april_areas import april_areas, april_size_mm
from rig.targets.printing.circle_areas import circle_areas, circles_size_mm
from rig.targets.printing.drawing import Area, Ink, Rect


def board_size_mm(target: Target) -> tuple[float, float]:
    """Return width and height of all squares; of tags and circles with what stands around them."""
    if isinstance(target, AprilGrid):
        return april_size_mm(target)
    if isinstance(target, CircleGrid):
        return circles_size_mm(target)
    return (target.columns + 1) * target.square_mm, (target.rows + 1) * target.square_mm


def board_areas(target: Target, x_mm: float, y_mm: float) -> tuple[Area, ...]:
    """Return what to paint for a board whose first square begins at a place on white paper.

    An inverted board is painted on a black ground that reaches half a square beyond it.
    """
    if isinstance(target, AprilGrid):
        return april_areas(target, x_mm, y_mm)
    if isinstance(target, CircleGrid):
        return circle_areas(target, x_mm, y_mm)
    if not isinstance(target, CharucoBoard):
        return (Area("black", _squares(target, x_mm, y_mm)),)
    black: Ink = "white" if target.inverted else "black"
    white: Ink = "black" if target.inverted else "white"
    areas = [Area(black, _squares(target, x_mm, y_mm))]
    if target.inverted:
        width_mm, height_mm = board_size_mm(target)
        side_mm = target.square_mm / 2
        ground = Rect(
            x_mm - side_mm, y_mm - side_mm, width_mm + 2 * side_mm, height_mm + 2 * side_mm
        )
        areas.insert(0, Area("black", (ground,)))
    margin_mm = (target.square_mm - target.marker_mm) / 2
    for row, column in np.argwhere(target.white).tolist():
        number = int(target.marker_numbers[row, column])
        left_mm = x_mm + column * target.square_mm + margin_mm
        top_mm = y_mm + row * target.square_mm + margin_mm
        areas.append(Area(black, (Rect(left_mm, top_mm, target.marker_mm, target.marker_mm),)))
        areas.append(Area(white, _bits(target, number, left_mm, top_mm)))
    return tuple(areas)


def _squares(target: Checkerboard | CharucoBoard, x_mm: float, y_mm: float) -> tuple[Rect, ...]:
    side_mm = target.square_mm
    first_is_white = isinstance(target, CharucoBoard) and target.first_is_white
    return tuple(
        Rect(x_mm + column * side_mm, y_mm + row * side_mm, side_mm, side_mm)
        for row in range(target.rows + 1)
        for column in range(target.columns + 1)
        if (row + column) % 2 == int(first_is_white)
    )


def _bits(board: CharucoBoard, number: int, left_mm: float, top_mm: float) -> tuple[Rect, ...]:
    """White bits of a marker; those side by side make one rectangle."""
    bit_mm = board.marker_mm / board.bits_across
    rects: list[Rect] = []
    for row, bits in enumerate(board.marker_bits[number].tolist(), start=1):
        for white, run in groupby(enumerate(bits, start=1), key=lambda item: item[1]):
            places = [place for place, _ in run]
            if white:
                rects.append(
                    Rect(
                        left_mm + places[0] * bit_mm,
                        top_mm + row * bit_mm,
                        len(places) * bit_mm,
                        bit_mm,
                    )
                )
    return tuple(rects)
