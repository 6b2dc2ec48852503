"""Figures made of photographs: the corners that were found, and stops without a board."""

from collections.abc import Sequence
from typing import cast

import cv2
import numpy as np

from rig.frames import GreyImage
from rig.report.evidence import FailedPicture, Picture
from rig.report.figures import (
    ORANGE,
    TITLE_IN,
    VERMILLION,
    WIDTH_IN,
    Axes,
    Figure,
    draw_svg,
    panels,
    show_grey,
)

MOST_PIXELS_ACROSS = 640
"""Overviews of larger images are reduced: the file should stay small."""
COLUMNS = 3
CLOSE_UP_SQUARES = 1.2
"""Half the height of the close-ups, in squares of the board."""


def corner_figure(pictures: Sequence[Picture], reference: int) -> str:
    """Overview and close-up of the reference view at every shown stop."""

    def draw(figure: Figure) -> None:
        for picture, (overview, close_up) in zip(pictures, _columns(figure, 2), strict=False):
            image = picture.images[reference]
            show_whole(overview, image)
            _draw_board(overview, picture, size=2.5)
            overview.set_title(f"{picture.sample.reached_mm:.1f} mm")
            rows, columns = _show_centre(close_up, image, picture)
            _draw_board(close_up, picture, size=13.0)
            close_up.set_title(f"middle, {columns} × {rows} px")

    height_in = _height_in(pictures[0].images[reference], 2)
    return draw_svg("corners", "Corners found in the reference view", height_in, draw)


def failure_figure(failures: Sequence[FailedPicture]) -> str:
    """The reference view of stops that gave no slope."""

    def draw(figure: Figure) -> None:
        for failure, [axes] in zip(failures, _columns(figure, 1), strict=False):
            show_whole(axes, failure.image)
            axes.set_title(f"{failure.sample.reached_mm:.1f} mm")

    return draw_svg("failures", "Pictures without a slope", _height_in(failures[0].image, 1), draw)


def _height_in(image: GreyImage, rows: int) -> float:
    """Height of a figure with so many rows of pictures, titles included."""
    return rows * (TITLE_IN + WIDTH_IN / COLUMNS * image.shape[0] / image.shape[1])


def _columns(figure: Figure, rows: int) -> list[tuple[Axes, ...]]:
    """Panels for pictures, column by column; empty ones stay invisible."""
    grid = panels(
        figure, rows, COLUMNS, top_in=TITLE_IN, row_gap_in=TITLE_IN, room_for_labels=False
    )
    for axes in figure.axes:
        axes.set_axis_off()
    return list(zip(*grid, strict=True))


def show_whole(axes: Axes, image: GreyImage) -> None:
    """Show a picture in its own pixel coordinates; large ones are reduced."""
    rows, columns = image.shape
    scale = min(1.0, MOST_PIXELS_ACROSS / columns)
    size = (round(columns * scale), round(rows * scale))
    if scale < 1.0:
        image = cast("GreyImage", cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    show_grey(axes, image, extent=(-0.5, columns - 0.5, rows - 0.5, -0.5))


def _show_centre(axes: Axes, image: GreyImage, picture: Picture) -> tuple[int, int]:
    """Show the middle of the board in the shape of the image; return its rows and columns, px."""
    half_rows = CLOSE_UP_SQUARES * picture.square_px
    half_columns = half_rows * image.shape[1] / image.shape[0]
    across, down = picture.centre_px
    top, left = max(0, int(down - half_rows)), max(0, int(across - half_columns))
    part = image[top : int(down + half_rows) + 2, left : int(across + half_columns) + 2]
    bottom, right = top + part.shape[0], left + part.shape[1]
    show_grey(axes, part, extent=(left - 0.5, right - 0.5, bottom - 0.5, top - 0.5))
    axes.set(
        xlim=(across - half_columns, across + half_columns),
        ylim=(down + half_rows, down - half_rows),
    )
    return round(2 * half_rows), round(2 * half_columns)


def _draw_board(axes: Axes, picture: Picture, *, size: float) -> None:
    limits = axes.get_xlim(), axes.get_ylim()
    closed = np.concatenate([picture.outline_px, picture.outline_px[:1]])
    axes.plot(*closed.T, color=ORANGE, linewidth=1.0)
    corners = picture.corners_px.reshape(-1, 2)
    axes.plot(*corners.T, marker="+", color=VERMILLION, linestyle="none", markersize=size, mew=0.9)
    axes.set(xlim=limits[0], ylim=limits[1])
