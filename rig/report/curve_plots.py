"""Figures of the curve: slope against distance, residuals, held-out errors."""

from typing import Any

import numpy as np

from rig.curve import Candidate, CurveFit, CurvePoint, HoldoutError, LinearLaw, depth_errors
from rig.report.figures import (
    BLACK,
    GREEN,
    GREY,
    LEGEND_IN,
    ORANGE,
    PALE,
    TITLE_IN,
    Axes,
    Figure,
    draw_svg,
    legend_above,
    panels,
)
from rig.report.marks import plot_stops

DISTANCE = "distance from the reference camera (mm)"


def slope_figure(fit: CurveFit, points: tuple[CurvePoint, ...]) -> str:
    """Slope against distance with the curve and the straight laws."""

    def draw(figure: Figure) -> None:
        [[axes]] = panels(figure)
        distance_mm = np.linspace(*fit.best.valid_mm, 400)
        slope_px = fit.best.slope_px(distance_mm)
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        axes.plot(distance_mm, slope_px, color=BLACK, label=f"curve ({fit.best.model})")
        for law in fit.laws:
            _draw_law(axes, law)
        plot_stops(axes, points, [p.slope_px for p in points])
        if fit.best.focus_mm is not None:
            axes.axvline(fit.best.focus_mm, color=GREY, linewidth=0.9, linestyle=(0, (1, 2)))
            axes.annotate(
                f"focus distance {fit.best.focus_mm:.1f} mm",
                (fit.best.focus_mm, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(5.0, 0.0),
                textcoords="offset points",
                verticalalignment="top",
                fontsize=7.5,
            )
        room_px = 0.06 * float(np.ptp(slope_px))
        axes.set_ylim(float(slope_px.min()) - room_px, float(slope_px.max()) + room_px)
        axes.set(xlabel=DISTANCE, ylabel="slope m (px per view step)")
        axes.legend(loc="upper right", bbox_to_anchor=(1.0, 0.93))

    return draw_svg("slope", "Slope against distance", 3.9, draw)


def residual_figure(fit: CurveFit) -> str:
    """Residuals of every candidate, one row each, as slope and as depth."""

    def draw(figure: Figure) -> None:
        rows = panels(
            figure,
            len(fit.candidates),
            2,
            top_in=LEGEND_IN + TITLE_IN,
            row_gap_in=TITLE_IN + 0.1,
            share_x=True,
        )
        for candidate, (left, right) in zip(fit.candidates, rows, strict=True):
            _draw_residuals(candidate, left, right)
            if candidate.curve.model == fit.best.model:
                left.set_title(f"{candidate.curve.model} (chosen)")
        for axes in rows[-1]:
            axes.set_xlabel(DISTANCE)
        legend_above(figure, 4)

    height_in = 0.8 + 1.3 * len(fit.candidates)
    return draw_svg("residuals", "Residuals of every model", height_in, draw)


def holdout_figure(fit: CurveFit, holdout: HoldoutError, limit_pct: float) -> str:
    """Error at held-out distances with the band of the headline, in mm and per cent."""
    curve = fit.best
    distance_mm = np.linspace(*curve.valid_mm, 200)
    errors = depth_errors(curve, holdout, distance_mm.tolist())
    band_mm = np.array([error.expanded_mm for error in errors])
    points = [residual.point for residual in holdout.residuals]

    def draw(figure: Figure) -> None:
        [[left, right]] = panels(figure, 1, 2, top_in=LEGEND_IN + 0.05)
        for axes, band in ((left, band_mm), (right, 100 * band_mm / distance_mm)):
            axes.fill_between(
                distance_mm, -band, band, color=PALE, linewidth=0, label="expected, k=2"
            )
            axes.axhline(0.0, color=GREY, linewidth=0.7)
            axes.set_xlabel(DISTANCE)
        plot_stops(left, points, [r.error_mm for r in holdout.residuals])
        plot_stops(right, points, [r.error_pct for r in holdout.residuals])
        for sign in (-1, 1):
            label = f"gate, {limit_pct:g} %" if sign > 0 else None
            right.axhline(sign * limit_pct, color=ORANGE, linestyle="--", label=label)
        left.set(ylabel="depth error (mm)")
        right.set(ylabel="depth error (% of distance)")
        legend_above(figure, 4)

    return draw_svg("holdout", "Depth error at held-out distances", 2.8, draw)


def _draw_law(axes: Axes, law: LinearLaw) -> None:
    near_mm, far_mm = law.distances_mm
    ends_mm = np.array([near_mm, far_mm])
    style: dict[str, Any] = {"linestyle": (0, (5, 3))}
    label = f"straight line {law.side} the focus"
    if law.scope == "holds":
        style = {"linewidth": 2.6, "alpha": 0.5}
        label = f"where a line holds {law.side} the focus"
    axes.plot(
        ends_mm,
        law.px_per_mm * (ends_mm - law.zero_mm),
        color=ORANGE if law.side == "before" else GREEN,
        label=label,
        **style,
    )


def _draw_residuals(candidate: Candidate, left: Axes, right: Axes) -> None:
    points = [residual.point for residual in candidate.residuals]
    plot_stops(left, points, [r.error_px for r in candidate.residuals])
    plot_stops(right, points, [r.error_pct for r in candidate.residuals])
    for axes in (left, right):
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        low, high = axes.get_ylim()
        reach = 1.1 * max(abs(low), abs(high))
        axes.set_ylim(-reach, reach)
    left.set(title=candidate.curve.model, ylabel="slope (px)")
    right.set(ylabel="depth (%)")
