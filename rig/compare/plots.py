"""Figures of a comparison: pictures with one common scale, and error against distance."""

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compare.baselines import OURS, Map
from rig.compare.distances import NAMES, WITH_PLANE, BoardErrors
from rig.compare.frames import FrameComparison
from rig.report.figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LEGEND_IN,
    ORANGE,
    PURPLE,
    TITLE_IN,
    VERMILLION,
    WIDTH_IN,
    Axes,
    Figure,
    draw_svg,
    legend_above,
    panels,
    show_grey,
)

COLUMNS = 3
MOST_PIXELS_ACROSS = 640
"""Larger maps are shown in every other pixel or fewer: the file should stay small."""
_NO_ANSWER = 128
_COLOURS = dict(zip(NAMES, (BLACK, BLUE, PURPLE, GREEN, ORANGE, VERMILLION), strict=True))
_MARKERS = dict(zip(NAMES, ("s", "o", "v", "^", "D", "X"), strict=True))


def picture_figure(frames: FrameComparison, unit: str) -> str:
    """The reference view and what every method makes of it, all in the colours of one scale."""
    span = common_scale(frames.maps[OURS.name])
    near_is_large = unit != "mm"
    rows = math.ceil((2 + len(frames.maps)) / COLUMNS)

    def draw(figure: Figure) -> None:
        grid = panels(
            figure, rows, COLUMNS, top_in=TITLE_IN, row_gap_in=TITLE_IN, room_for_labels=False
        )
        cells = [axes for row in grid for axes in row]
        for axes in cells:
            axes.set_axis_off()
        height, width = frames.image.shape
        step = math.ceil(width / MOST_PIXELS_ACROSS)
        show_grey(
            cells[0],
            frames.image[::step, ::step],
            extent=(-0.5, width - 0.5, height - 0.5, -0.5),
        )
        cells[0].set_title("reference view")
        for axes, (name, values) in zip(cells[1:], frames.maps.items(), strict=False):
            axes.imshow(in_colour(values[::step, ::step], span, near_is_large=near_is_large))
            axes.grid(visible=False)
            axes.set_title(name)
        _draw_scale(cells[len(frames.maps) + 1], span, unit, near_is_large=near_is_large)

    height_in = rows * (
        TITLE_IN + WIDTH_IN / COLUMNS * frames.image.shape[0] / frames.image.shape[1]
    )
    return draw_svg("pictures", "Maps of all methods", height_in, draw)


def common_scale(values: Map) -> tuple[float, float]:
    """Range of colours: all answers of a map but the outermost hundredths."""
    known = values[np.isfinite(values)]
    low, high = np.percentile(known, [1.0, 99.0]).tolist() if known.size else (0.0, 1.0)
    return low, max(high, low + 1e-6)


def in_colour(values: Map, span: tuple[float, float], *, near_is_large: bool) -> NDArray[np.uint8]:
    """Colour a map (H, W) for (H, W, 3): near is warm, far is cool, grey has no answer."""
    low, high = span
    known = np.isfinite(values)
    share = (np.where(known, values, low) - low) / (high - low)
    levels = np.clip(255.0 * (share if near_is_large else 1.0 - share), 0.0, 255.0)
    colour = cv2.applyColorMap(levels.astype(np.uint8), cv2.COLORMAP_TURBO)
    rgb = np.array(cv2.cvtColor(colour, cv2.COLOR_BGR2RGB), np.uint8)
    rgb[~known] = _NO_ANSWER
    return rgb


def _draw_scale(cell: Axes, span: tuple[float, float], unit: str, *, near_is_large: bool) -> None:
    bar = cell.inset_axes((0.05, 0.55, 0.9, 0.09))
    ramp = np.linspace(*span, 256, dtype=np.float32)[None]
    bar.imshow(
        in_colour(ramp, span, near_is_large=near_is_large), aspect="auto", extent=(*span, 0.0, 1.0)
    )
    bar.grid(visible=False)
    bar.set_yticks([])
    bar.set_xlabel(unit)
    bar.set_title("all maps; grey: no answer", fontweight="normal")


def error_figure(boards: Sequence[BoardErrors]) -> str:
    """Mean error and spread of every method on the board, against distance."""
    distance_mm = [board.distance_mm for board in boards]

    def draw(figure: Figure) -> None:
        ((mean,), (spread,)) = panels(figure, 2, 1, top_in=LEGEND_IN, row_gap_in=0.15, share_x=True)
        for name in NAMES:
            ours = name in (OURS.name, WITH_PLANE)
            errors = [board.errors[name] for board in boards]
            style: dict[str, Any] = {
                "color": _COLOURS[name],
                "marker": _MARKERS[name],
                "markersize": 4.5 if ours else 3.5,
                "linewidth": 1.8 if ours else 0.9,
                "zorder": 3.0 if ours else 2.0,
                "label": name,
            }
            mean.plot(distance_mm, [error.mean_mm for error in errors], **style)
            spread.plot(distance_mm, [error.spread_mm for error in errors], **style)
        mean.axhline(0.0, color=GREY, linewidth=0.7, zorder=1.0)
        mean.set_ylabel("mean error (mm)")
        spread.set_yscale("log")
        spread.set_ylabel("spread over the board (mm)")
        spread.set_xlabel("distance of the stage (mm)")
        legend_above(figure, columns=len(NAMES))

    return draw_svg("errors", "Error of all methods against distance", 5.2, draw)
