"""The door to the plot library: figures without a display, as SVG whose text stays text."""

import re
from collections.abc import Callable
from html import escape
from io import StringIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.typing import RcKeyType
from numpy.typing import NDArray

from rig.frames import GreyImage

WIDTH_IN = 7.4
LEFT_IN, RIGHT_IN, BOTTOM_IN, COLUMN_GAP_IN = 0.7, 0.06, 0.42, 0.78
LEGEND_IN, TITLE_IN = 0.28, 0.24
"""Room that one line of legend and one title take."""

# The colours of Okabe and Ito, which colour-blind readers can tell apart.
BLACK, GREY, PALE = "#1a1a1a", "#767676", "#dcdcdc"
BLUE, VERMILLION, GREEN, ORANGE, PURPLE = "#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7"

_STYLE: dict[RcKeyType, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "rig",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 8.0,
    "axes.labelcolor": BLACK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#ececec",
    "grid.linewidth": 0.6,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": BLACK,
    "ytick.labelcolor": BLACK,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 5.0,
    "image.cmap": "gray",
    "image.interpolation": "none",
}
_NO_METADATA = {"Creator": None, "Date": None, "Format": None, "Type": None}


def draw_svg(name: str, description: str, height_in: float, draw: Callable[[Figure], None]) -> str:
    """Draw a figure as an `<svg>` element; the same drawing gives the same text.

    Args:
        name: short and unique within the page; it begins every id inside.
        description: what the figure shows, for readers who cannot see it.
        height_in: height, inches.
        draw: puts everything into an empty figure.
    """
    with rc_context(_STYLE):
        figure = Figure(figsize=(WIDTH_IN, height_in))
        draw(figure)
        written = StringIO()
        figure.savefig(written, format="svg", metadata=_NO_METADATA)
    svg = written.getvalue()
    svg = svg[svg.index("<svg") :]
    # Several figures share one page: their ids must differ. Those of images are made of the pixels,
    # so that equal pictures collide, and nothing refers to them.
    svg = re.sub(r'(<image [^>]*?) id="[^"]*"', r"\1", svg)
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{escape(description)}"', 1)


def panels(
    figure: Figure,
    rows: int = 1,
    columns: int = 1,
    *,
    top_in: float = 0.1,
    row_gap_in: float = 0.0,
    room_for_labels: bool = True,
    share_x: bool = False,
) -> list[list[Axes]]:
    """Divide a figure evenly; the frames of all figures then lie one below the other.

    Args:
        figure: empty.
        rows: of panels.
        columns: of panels.
        top_in: room above the first row, for titles and a legend, inches.
        row_gap_in: room between rows, inches.
        room_for_labels: whether the panels have labels left and below.
        share_x: one horizontal axis for all.
    """
    width_in, height_in = figure.get_size_inches().tolist()
    left_in, bottom_in, gap_in = (
        (LEFT_IN, BOTTOM_IN, COLUMN_GAP_IN) if room_for_labels else (RIGHT_IN, RIGHT_IN, 0.15)
    )
    across_in = (width_in - left_in - RIGHT_IN - (columns - 1) * gap_in) / columns
    down_in = (height_in - top_in - bottom_in - (rows - 1) * row_gap_in) / rows
    place = {
        "left": left_in / width_in,
        "right": 1.0 - RIGHT_IN / width_in,
        "bottom": bottom_in / height_in,
        "top": 1.0 - top_in / height_in,
        "wspace": gap_in / across_in,
        "hspace": row_gap_in / down_in,
    }
    grid = figure.subplots(rows, columns, sharex=share_x, squeeze=False, gridspec_kw=place)
    return [list(row) for row in grid]


def legend_above(figure: Figure, columns: int) -> None:
    """Put one legend for all panels along the upper edge; each label once."""
    handles = {
        label: handle
        for axes in figure.axes
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    corner = (LEFT_IN / figure.get_size_inches()[0], 1.0)
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="upper left",
        bbox_to_anchor=corner,
        ncols=columns,
        borderpad=0.0,
        borderaxespad=0.2,
    )


def show_grey(
    axes: Axes, image: GreyImage | NDArray[np.float32], *, extent: tuple[float, float, float, float]
) -> None:
    """Show an image in grey, its darkest pixel black and its brightest white."""
    axes.imshow(image, vmin=float(image.min()), vmax=float(image.max()), extent=extent)
    axes.grid(visible=False)
