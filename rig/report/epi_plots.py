"""Epipolar-plane images as figures."""

from collections.abc import Sequence
from itertools import pairwise

from rig.epipolar import Label
from rig.report.epi import Epi
from rig.report.figures import (
    BLUE,
    LEGEND_IN,
    PURPLE,
    TITLE_IN,
    VERMILLION,
    Axes,
    Figure,
    draw_svg,
    legend_above,
    panels,
    show_grey,
)

STRIP_SHARE = 0.62
"""Height of a view's strip, as a part of the least distance between views."""
LINES = {
    Label.NEARER: ("nearer than the focus distance (m > 0)", VERMILLION, "-"),
    Label.BEYOND: ("beyond it (m < 0)", BLUE, "-"),
    Label.OCCLUSION: ("occlusion boundary", PURPLE, (0, (3, 1.5))),
}


def epi_figure(epis: Sequence[tuple[float, Sequence[Epi]]]) -> str:
    """Draw one row of panels per distance, the H image left and the V image right.

    Args:
        epis: distance, mm, and its images.
    """

    def draw(figure: Figure) -> None:
        rows = panels(figure, len(epis), 2, top_in=LEGEND_IN + TITLE_IN, row_gap_in=TITLE_IN + 0.4)
        for (distance_mm, images), row in zip(epis, rows, strict=True):
            by_kind = {epi.kind: epi for epi in images}
            for kind, axes in zip("HV", row, strict=True):
                epi = by_kind.get(kind)
                if epi is None:
                    axes.set_axis_off()
                else:
                    _draw_epi(axes, epi, distance_mm)
        legend_above(figure, 3)

    return draw_svg("epi", "Epipolar-plane images with fitted lines", 0.4 + 1.75 * len(epis), draw)


def _draw_epi(axes: Axes, epi: Epi, distance_mm: float) -> None:
    height = STRIP_SHARE * min(far - near for near, far in pairwise(epi.steps))
    left, right = epi.first_px - 0.5, epi.first_px + epi.grey.shape[1] - 0.5
    low, high = epi.steps[0] - 0.6 * height, epi.steps[-1] + 0.6 * height
    for step, grey in zip(epi.steps, epi.grey, strict=True):
        show_grey(axes, grey[None], extent=(left, right, step - height / 2, step + height / 2))
    known: set[Label] = set()
    for edge in sorted(epi.edges, key=lambda edge: edge.label):
        label, colour, dashes = LINES[edge.label]
        axes.plot(
            [edge.at_px - edge.slope_px * low, edge.at_px - edge.slope_px * high],
            [low, high],
            color=colour,
            linestyle=dashes,
            linewidth=1.1,
            label=None if edge.label in known else label,
        )
        known.add(edge.label)
    name, along, place = (
        ("row v", "u", "x (view steps)") if epi.kind == "H" else ("column u", "v", "y (view steps)")
    )
    axes.set_aspect("auto")
    axes.set(
        title=f"{epi.kind}, {distance_mm:.1f} mm, {name} = {epi.line_px} px",
        xlabel=f"{along} (px)",
        ylabel=place,
        xlim=(left, right),
        ylim=(low, high),
        yticks=epi.steps,
    )
    axes.set_yticklabels([f"{step:+.2f}" if step else "0" for step in epi.steps])
