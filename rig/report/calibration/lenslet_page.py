"""The page of a calibration of lenslets: the fit over the white picture."""

import math
from importlib.resources import files

import numpy as np

from rig.arrays import Float
from rig.lenslet.array import numbers_of
from rig.lenslet.fit import lenslets_inside
from rig.report.calibration.lenslets import ShownLenslets
from rig.report.figures import (
    BLUE,
    ORANGE,
    TITLE_IN,
    VERMILLION,
    WIDTH_IN,
    Axes,
    Figure,
    draw_svg,
    panels,
)
from rig.report.page import render_template

TEMPLATE = "lenslets.html.j2"
_LENSLETS_ACROSS = 7.0
"""Width of the close-ups."""
_GAIN_SPAN = 0.1
"""Gains of lenslets from black to white: 1 - span to 1 + span."""


def lenslet_html(shown: ShownLenslets) -> str:
    """Return the page as one HTML file that needs nothing else; the same input, the same bytes."""
    return render_template(
        files("rig.report.calibration") / TEMPLATE,
        shown=shown,
        lattice=shown.array.lattice,
        quality=shown.quality,
        rotation_deg=math.degrees(shown.array.lattice.rotation_rad),
        sigma_px=2.0 * shown.array.lattice.sigma_px,
        missing=shown.fitted.missing,
        dirty=shown.fitted.dirty,
        figures={"fit": _fit_figure(shown), "light": _light_figure(shown)},
    )


def _fit_figure(shown: ShownLenslets) -> str:
    """Close-ups of the corners and of the middle, with the fitted centres."""
    height_px, width_px = shown.white.shape
    side_px = min(_LENSLETS_ACROSS * shown.array.lattice.spacing_px, width_px, height_px)
    right_px, low_px = width_px - side_px, height_px - side_px
    places = (
        ("upper left", 0.0, 0.0),
        ("middle", right_px / 2.0, low_px / 2.0),
        ("upper right", right_px, 0.0),
        ("lower left", 0.0, low_px),
        ("lower right", right_px, low_px),
    )

    def draw(figure: Figure) -> None:
        rows = panels(figure, 1, len(places), top_in=TITLE_IN, room_for_labels=False)
        for axes, (title, x_px, y_px) in zip(rows[0], places, strict=True):
            _close_up(axes, shown, (round(x_px), round(y_px)), round(side_px))
            axes.set_title(title)

    across_in = WIDTH_IN / len(places)
    return draw_svg("fit", "Fitted centres over the white picture", across_in + TITLE_IN, draw)


def _close_up(axes: Axes, shown: ShownLenslets, first: tuple[int, int], side_px: int) -> None:
    x, y = first
    cut = shown.white[y : y + side_px, x : x + side_px]
    edges = (x - 0.5, x + cut.shape[1] - 0.5, y + cut.shape[0] - 0.5, y - 0.5)
    axes.imshow(cut, vmin=0.0, vmax=float(np.percentile(shown.white[::4, ::4], 99)), extent=edges)
    height_px, width_px = shown.white.shape
    i, j, centre_px = lenslets_inside(shown.array.lattice, (width_px, height_px), margin_px=0.0)
    unusable = {*shown.fitted.missing, *shown.fitted.dirty}
    odd = np.array([one in unusable for one in zip(i.tolist(), j.tolist(), strict=True)])
    _dots(axes, centre_px[~odd], "+", BLUE)
    _dots(axes, centre_px[odd], "x", VERMILLION)
    axes.set_xlim(edges[0], edges[1])
    axes.set_ylim(edges[2], edges[3])
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(visible=False)


def _dots(axes: Axes, centre_px: Float, marker: str, colour: str) -> None:
    low_x, high_x = axes.get_xlim()
    high_y, low_y = axes.get_ylim()
    near = (centre_px >= (low_x, low_y)) & (centre_px <= (high_x, high_y))
    shown_px = centre_px[near.all(axis=1)]
    axes.plot(shown_px[:, 0], shown_px[:, 1], marker, color=colour, markersize=4.0)


def _light_figure(shown: ShownLenslets) -> str:
    """Light of the micro-images over the picture, and the gains of single lenslets."""
    array = shown.array
    rows, columns = array.gains.shape
    j, q = np.meshgrid(
        np.arange(rows) + array.first[1], np.arange(columns) + array.first[0], indexing="ij"
    )
    centre_px = array.lattice.centres_px(numbers_of(array.lattice.kind, q, j), j).reshape(-1, 2)
    light = array.vignetting.light(centre_px, np.zeros((rows * columns, 2))).reshape(rows, columns)
    light = np.where(array.gains > 0.0, light / light.max(), np.nan)
    gains = np.where(array.gains > 0.0, array.gains, np.nan)

    def draw(figure: Figure) -> None:
        (left, right), *_ = panels(figure, 1, 2, top_in=TITLE_IN, room_for_labels=False)
        left.imshow(light, vmin=0.0, vmax=1.0)
        left.set_title("light of the middle of micro-images, 0 to 1")
        right.imshow(gains, vmin=1.0 - _GAIN_SPAN, vmax=1.0 + _GAIN_SPAN)
        right.set_title(f"gain of single lenslets, {1 - _GAIN_SPAN:g} to {1 + _GAIN_SPAN:g}")
        for axes in (left, right):
            axes.set_facecolor(ORANGE)
            axes.set_xticks([])
            axes.set_yticks([])
            axes.grid(visible=False)

    height_in = 0.5 * WIDTH_IN * rows / columns + TITLE_IN
    return draw_svg("light", "Vignetting, and gains of single lenslets", height_in, draw)
