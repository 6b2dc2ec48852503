"""Figures of the stops: scatter, direction, stillness, estimators, temperature."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rig.curve import Curve
from rig.records import Sample
from rig.report.curve_plots import DISTANCE
from rig.report.evidence import Evidence
from rig.report.figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LEGEND_IN,
    ORANGE,
    PALE,
    PURPLE,
    TITLE_IN,
    Axes,
    Figure,
    draw_svg,
    legend_above,
    panels,
)
from rig.report.marks import plot_stops
from rig.report.scatter import (
    DirectionPair,
    EstimatorGap,
    deviations,
    direction_pairs,
    mm_per_px,
)
from rig.sweep.points import StopResult
from rig.sweep.request import sweep_setup

WORTH_PLOTTING_DEGC = 0.1
"""A temperature that changes by less is told in words."""


def repeat_figure(evidence: Evidence) -> str:
    """Samples against their stop, their scatter as depth, both directions, and stillness."""
    stops, curve = evidence.result.stops, evidence.result.fit.best

    def draw(figure: Figure) -> None:
        (samples, scatter), (directions, motion) = panels(
            figure, 2, 2, top_in=TITLE_IN, row_gap_in=TITLE_IN + 0.12, share_x=True
        )
        _draw_deviations(samples, evidence)
        _draw_scatter(scatter, stops, curve)
        _draw_directions(directions, direction_pairs(stops, curve))
        limit_px = sweep_setup(evidence.profile).config.max_motion_px
        _draw_motion(motion, stops, limit_px)
        # Said once for all panels: an empty one has no distances of its own.
        motion.set_xlim(*_span_mm(stops))
        for axes in (directions, motion):
            axes.set_xlabel(DISTANCE)

    return draw_svg("repeat", "Scatter, direction and stillness of every stop", 4.6, draw)


def estimator_figure(gaps: Sequence[EstimatorGap], limit_pct: float) -> str:
    """Corner tracks and dense estimator against the line fit, as slope and as depth."""

    def draw(figure: Figure) -> None:
        [[left, right]] = panels(figure, 1, 2, top_in=LEGEND_IN + 0.05)
        distance_mm = [gap.point.distance_mm for gap in gaps]
        limits_px = np.array([gap.limit_px for gap in gaps])
        left.fill_between(
            distance_mm, -limits_px, limits_px, color=PALE, linewidth=0, label="no alarm"
        )
        right.axhspan(-limit_pct, limit_pct, color=PALE, linewidth=0)
        series = (
            ("corner tracks", "P", GREEN, [gap.corner_px for gap in gaps]),
            ("dense estimator", "s", PURPLE, [gap.dense_px for gap in gaps]),
        )
        for label, marker, colour, values in series:
            known = [(g, v) for g, v in zip(gaps, values, strict=True) if v is not None]
            places_mm = [gap.point.distance_mm for gap, _ in known]
            style: dict[str, Any] = {
                "marker": marker,
                "color": colour,
                "linestyle": "none",
                "label": label,
            }
            left.plot(places_mm, [value for _, value in known], **style)
            right.plot(places_mm, [gap.pct_per_px * value for gap, value in known], **style)
        for axes in (left, right):
            axes.axhline(0.0, color=GREY, linewidth=0.7)
            axes.set_xlabel(DISTANCE)
        left.set_ylabel("slope less line fit (px)")
        right.set_ylabel("the same as depth (% of distance)")
        legend_above(figure, 3)

    return draw_svg("estimators", "Three estimators of one slope", 2.8, draw)


def temperature_figure(samples: Sequence[Sample]) -> str | None:
    """Temperature against time, where it was measured and varies."""
    known = [(s.taken_at, s.temperature_degc) for s in samples if s.temperature_degc is not None]
    degrees = [degc for _, degc in known]
    if not known or max(degrees) - min(degrees) < WORTH_PLOTTING_DEGC:
        return None
    begin = known[0][0]

    def draw(figure: Figure) -> None:
        [[axes]] = panels(figure)
        minutes = [(at - begin).total_seconds() / 60.0 for at, _ in known]
        axes.plot(minutes, degrees, marker="o", markersize=3.0, color=BLUE)
        axes.set(xlabel="time since the first sample (min)", ylabel="temperature (°C)")

    return draw_svg("temperature", "Temperature of the camera", 1.9, draw)


def _draw_deviations(axes: Axes, evidence: Evidence) -> None:
    axes.set(title="each sample less its stop's mean", ylabel="slope (0.001 px)")
    found = deviations(evidence.result.stops, evidence.samples, evidence.measurements)
    if _said_empty(axes, found, "one sample per stop:\nno scatter to see"):
        return
    plot_stops(axes, [d.point for d in found], [1000.0 * d.error_px for d in found])
    _shrink(axes, 3.2)
    axes.axhline(0.0, color=GREY, linewidth=0.7)


def _draw_scatter(axes: Axes, stops: Sequence[StopResult], curve: Curve) -> None:
    axes.set(title="standard deviation of one sample, as depth", ylabel="std (mm)")
    points = [s.point for s in stops if s.point is not None and s.point.samples > 1]
    if _said_empty(axes, points, "one sample per stop:\nno scatter to see"):
        return
    plot_stops(axes, points, [p.std_px * abs(mm_per_px(curve, p.distance_mm)) for p in points])
    axes.set_ylim(bottom=0.0)


def _draw_directions(axes: Axes, pairs: Sequence[DirectionPair]) -> None:
    axes.set(title="backward less forward, k=2 bars", ylabel="depth (mm)")
    if _said_empty(axes, pairs, "no distance was visited\nin both directions"):
        return
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    axes.errorbar(
        [pair.distance_mm for pair in pairs],
        [pair.difference_mm for pair in pairs],
        yerr=[pair.expanded_mm for pair in pairs],
        fmt="<",
        color=BLUE,
        capsize=2.5,
        elinewidth=0.9,
    )


def _draw_motion(axes: Axes, stops: Sequence[StopResult], limit_px: float) -> None:
    axes.set(title="motion of the corners during a stop", ylabel="rms (px)")
    moved = [(s.stop, s.motion_px) for s in stops if s.motion_px is not None]
    if _said_empty(axes, moved, "one sample per stop:\nstillness not proven"):
        return
    for direction, marker in (("forward", "o"), ("backward", "<")):
        chosen = [(s.distance_mm, m) for s, m in moved if s.direction == direction]
        axes.plot(
            [mm for mm, _ in chosen],
            [px for _, px in chosen],
            marker,
            color=BLACK,
            fillstyle="none",
            clip_on=False,
        )
    axes.axhline(limit_px, color=ORANGE, linestyle="--", label=f"limit {limit_px:g} px")
    axes.set_ylim(0.0, 1.25 * max(limit_px, *(px for _, px in moved)))
    axes.legend(loc="upper right")


def _span_mm(stops: Sequence[StopResult]) -> tuple[float, float]:
    """Nearest and farthest distance, with some room beside them."""
    distances_mm = [stop.stop.distance_mm for stop in stops]
    near_mm, far_mm = min(distances_mm), max(distances_mm)
    room_mm = 0.05 * (far_mm - near_mm)
    return near_mm - room_mm, far_mm + room_mm


def _said_empty(axes: Axes, values: Sequence[object], why: str) -> bool:
    """Say in an empty panel why it is empty."""
    if values:
        return False
    axes.text(
        0.5, 0.5, why, transform=axes.transAxes, ha="center", va="center", color=GREY, wrap=True
    )
    axes.set_yticks([])
    return True


def _shrink(axes: Axes, size: float) -> None:
    for line in axes.get_lines():
        line.set_markersize(size)
