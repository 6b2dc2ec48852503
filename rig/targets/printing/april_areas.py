"""The ink of an AprilGrid: tags, and the small squares that touch their corners."""

from itertools import groupby

from rig.targets.aprilgrid.board import AprilGrid, tag_bits
from rig.targets.printing.drawing import Area, Rect


def april_size_mm(grid: AprilGrid) -> tuple[float, float]:
    """Return width and height with the outer small squares."""
    step_mm, gap_mm = grid.tag_mm * (1.0 + grid.spacing), grid.tag_mm * grid.spacing
    return grid.tag_columns * step_mm + gap_mm, grid.tag_rows * step_mm + gap_mm


def april_areas(grid: AprilGrid, x_mm: float, y_mm: float) -> tuple[Area, ...]:
    """Return what to paint on white paper for a grid whose outer squares begin at a place."""
    step_mm, gap_mm = grid.tag_mm * (1.0 + grid.spacing), grid.tag_mm * grid.spacing
    squares = [
        Rect(x_mm + column * step_mm, y_mm + row * step_mm, gap_mm, gap_mm)
        for row in range(grid.tag_rows + 1)
        for column in range(grid.tag_columns + 1)
    ]
    tags: list[Rect] = []
    white: list[Rect] = []
    for (row, column), number in _numbered(grid):
        left_mm = x_mm + gap_mm + column * step_mm
        top_mm = y_mm + gap_mm + row * step_mm
        tags.append(Rect(left_mm, top_mm, grid.tag_mm, grid.tag_mm))
        white += _bits(grid, number, left_mm, top_mm)
    return Area("black", (*squares, *tags)), Area("white", tuple(white))


def _numbered(grid: AprilGrid) -> list[tuple[tuple[int, int], int]]:
    return [
        ((row, column), int(number))
        for row, numbers in enumerate(grid.tag_numbers.tolist())
        for column, number in enumerate(numbers)
    ]


def _bits(grid: AprilGrid, number: int, left_mm: float, top_mm: float) -> list[Rect]:
    """White bits of a tag; those side by side make one rectangle."""
    bit_mm = grid.tag_mm / grid.bits_across
    rects: list[Rect] = []
    for row, bits in enumerate(tag_bits()[number].tolist(), start=grid.border_bits):
        for is_white, run in groupby(enumerate(bits, grid.border_bits), key=lambda item: item[1]):
            places = [place for place, _ in run]
            if is_white:
                rects.append(
                    Rect(
                        left_mm + places[0] * bit_mm,
                        top_mm + row * bit_mm,
                        len(places) * bit_mm,
                        bit_mm,
                    )
                )
    return rects
