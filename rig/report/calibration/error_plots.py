"""How far points are from where the calibration puts them: per picture, and over the picture."""

import numpy as np

from rig.report.calibration.shown import ShownCalibration
from rig.report.calibration.view_panels import draw_views
from rig.report.figures import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    Axes,
    Figure,
    draw_svg,
    legend_above,
    panels,
)

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, GREY)
_MOST_TICKS = 30
_ARROW_SHARE = 0.06
"""Length of the arrow of a p95 residual, as a share of the picture's width."""


def bar_figure(shown: ShownCalibration) -> str:
    """Mean distance per picture and camera, with the overall mean; held-out ones as dots."""
    calibration = shown.calibration
    names = calibration.geometry.names
    numbers = list(calibration.pictures)
    place = {number: i for i, number in enumerate(numbers)}
    width = 0.8 / len(names)

    def draw(figure: Figure) -> None:
        [[axes]] = panels(figure, top_in=0.3)
        for view, name in enumerate(names):
            mine = [r for r in shown.residuals_of(view) if not r.outlier.all()]
            x = np.array([place[r.picture] for r in mine]) + (view - (len(names) - 1) / 2) * width
            axes.bar(x, [r.rms_px for r in mine], width, color=_COLOURS[view % 5], label=name)
            held_out = np.array([r.held_out_rms_px for r in mine])
            axes.plot(x, held_out, marker=".", color="black", ls="none", ms=2.5,
                      label="held out" if view == 0 else None)  # fmt: skip
        axes.axhline(calibration.rms_px, color=VERMILLION, lw=1.0, label="all")
        axes.set(xlabel="picture", ylabel="reprojection error, rms px", xlim=(-0.7, len(numbers)))
        ticks = range(0, len(numbers), -(-len(numbers) // _MOST_TICKS))
        axes.set_xticks(ticks, [str(numbers[i]) for i in ticks])
        axes.grid(visible=False, axis="x")
        legend_above(figure, 8)

    return draw_svg("bars", "Reprojection error of every picture and camera", 2.4, draw)


def residual_figure(shown: ShownCalibration) -> str:
    """Residual vectors of all pictures at their places, exaggerated; outliers as crosses."""
    lengths = np.concatenate(
        [np.linalg.norm(r.residual_px[~r.outlier], axis=1) for r in shown.calibration.residuals]
    )
    typical_px = float(np.quantile(lengths, 0.95)) if len(lengths) else 1.0
    geometry = shown.calibration.geometry

    def draw_view(axes: Axes, view: int) -> None:
        camera = geometry.cameras[view]
        zoom = _ARROW_SHARE * camera.width_px / max(typical_px, 1e-9)
        for r in shown.residuals_of(view):
            kept = ~r.outlier
            axes.quiver(
                *r.xy_px[kept].T, *(r.residual_px[kept] * zoom).T,
                angles="xy", scale_units="xy", scale=1.0, width=0.0022, color=BLUE,
            )  # fmt: skip
            axes.plot(*r.xy_px[~kept].T, marker="x", color=VERMILLION, ls="none", ms=3.5, mew=0.8)
        axes.text(0.01, 0.02, f"× {zoom:.0f}", transform=axes.transAxes, fontsize=7.0, color=GREY)

    return draw_views("residuals", "Residual vectors over the picture", shown, draw_view)


def coverage_figure(shown: ShownCalibration) -> str:
    """Every point that was found, per view: where there is none, the lens is a guess."""

    def draw_view(axes: Axes, view: int) -> None:
        for r in shown.residuals_of(view):
            axes.plot(*r.xy_px.T, marker=".", color=BLUE, ls="none", ms=1.8, alpha=0.6)

    return draw_views("coverage", "Where points were found", shown, draw_view)
