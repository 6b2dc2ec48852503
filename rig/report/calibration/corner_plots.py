"""Corners found, origin of the board, and points reprojected, on the pictures themselves."""

import numpy as np

from rig.geometry.bundle.result import Residuals
from rig.report.calibration.shown import ShownCalibration
from rig.report.figures import (
    BLUE,
    GREEN,
    TITLE_IN,
    VERMILLION,
    WIDTH_IN,
    Axes,
    Figure,
    draw_svg,
    legend_above,
    panels,
)
from rig.report.picture_plots import show_whole

_MOST_COLUMNS = 3


def corner_figure(shown: ShownCalibration) -> str | None:
    """Circles: found. Crosses: reprojected. Square: point 0 of the board. None without images."""
    numbers = shown.shown_pictures
    if not numbers:
        return None
    found = {(r.picture, r.view): r for r in shown.calibration.residuals}
    names = shown.calibration.geometry.names[:_MOST_COLUMNS]
    first = next(iter(shown.images.values()))
    height_in = TITLE_IN + len(numbers) * (
        TITLE_IN + WIDTH_IN / len(names) * first.shape[0] / first.shape[1]
    )

    def draw(figure: Figure) -> None:
        grid = panels(
            figure, len(numbers), len(names),
            top_in=2 * TITLE_IN, row_gap_in=TITLE_IN, room_for_labels=False,
        )  # fmt: skip
        for number, row in zip(numbers, grid, strict=True):
            for view, (name, axes) in enumerate(zip(names, row, strict=True)):
                axes.set_axis_off()
                image = shown.images.get((number, view))
                if image is None:
                    continue
                show_whole(axes, image)
                axes.set_title(f"picture {number}, {name}")
                if (number, view) in found:
                    _mark(axes, found[number, view])
        legend_above(figure, 3)

    return draw_svg("corners", "Corners found and reprojected", height_in, draw)


def _mark(axes: Axes, residuals: Residuals) -> None:
    limits = axes.get_xlim(), axes.get_ylim()
    xy = residuals.xy_px
    again = xy - residuals.residual_px
    kept = ~residuals.outlier
    axes.plot(*xy.T, marker="o", mfc="none", mec=GREEN, ls="none", ms=4.5, mew=0.8, label="found")
    axes.plot(*again[kept].T, marker="x", color=VERMILLION, ls="none", ms=3.0, mew=0.8,
              label="reprojected")  # fmt: skip
    origin = np.flatnonzero(residuals.ids == 0)
    if len(origin):
        axes.plot(*xy[origin[:1]].T, marker="s", mfc="none", mec=BLUE, ls="none", ms=8.0,
                  mew=1.4, label="point 0 of the board")  # fmt: skip
    axes.set(xlim=limits[0], ylim=limits[1])
