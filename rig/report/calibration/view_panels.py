"""One framed picture per view, in the pixels of that view."""

from collections.abc import Callable

from rig.report.calibration.shown import ShownCalibration
from rig.report.figures import RIGHT_IN, TITLE_IN, WIDTH_IN, Axes, Figure, draw_svg, panels

_COLUMNS = 3
_TICKS_IN = 0.24


def draw_views(
    name: str, description: str, shown: ShownCalibration, draw_view: Callable[[Axes, int], None]
) -> str:
    """Draw a figure with one panel per view.

    Args:
        name: of the figure, unique within the page.
        description: for readers who cannot see it.
        shown: whose views.
        draw_view: draws the view of an index into axes that have its pixels.
    """
    geometry = shown.calibration.geometry
    count = len(geometry.names)
    columns = min(count, _COLUMNS)
    rows = -(-count // columns)
    across_in = (WIDTH_IN - (columns + 1) * RIGHT_IN - 0.3) / columns
    tallest = max(camera.height_px / camera.width_px for camera in geometry.cameras)
    height_in = rows * (across_in * tallest + TITLE_IN + _TICKS_IN)

    def draw(figure: Figure) -> None:
        grid = panels(
            figure, rows, columns,
            top_in=TITLE_IN, row_gap_in=TITLE_IN + _TICKS_IN, room_for_labels=False,
        )  # fmt: skip
        flat = [axes for row in grid for axes in row]
        for view, axes in enumerate(flat):
            if view >= count:
                axes.set_axis_off()
                continue
            camera = geometry.cameras[view]
            draw_view(axes, view)
            axes.set(
                xlim=(-0.5, camera.width_px - 0.5),
                ylim=(camera.height_px - 0.5, -0.5),
                aspect="equal",
                xticks=[],
                yticks=[],
                title=geometry.names[view],
            )
            axes.grid(visible=False)
            for spine in axes.spines.values():
                spine.set_visible(True)

    return draw_svg(name, description, height_in, draw)
