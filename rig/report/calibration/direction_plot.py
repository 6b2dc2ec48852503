"""How sure directions are over the picture of one camera alone."""

import numpy as np

from rig.geometry.bundle.direction_error import direction_sigma_px
from rig.geometry.bundle.part import COLUMNS, ROWS, nodes_px, part_of_sightings
from rig.report.calibration.shown import ShownCalibration
from rig.report.calibration.view_panels import draw_views
from rig.report.figures import Axes

_MOST = 0.95
"""Quantile at which the colours end: a corner must not hide the rest."""


def direction_figure(shown: ShownCalibration) -> str:
    """Error of where known directions appear, k = 2 px, over the picture."""
    geometry = shown.calibration.geometry
    camera = geometry.cameras[0]
    size_px = camera.width_px, camera.height_px
    used = [r.xy_px[~r.outlier] for r in shown.calibration.residuals]
    seen = part_of_sightings(used, size_px).ravel()
    sigma_px = direction_sigma_px(geometry, nodes_px(size_px).reshape(-1, 2), seen)
    values = 2.0 * sigma_px.reshape(ROWS, COLUMNS)

    def draw_view(axes: Axes, _view: int) -> None:
        half_x = (camera.width_px - 1) / (COLUMNS - 1) / 2
        half_y = (camera.height_px - 1) / (ROWS - 1) / 2
        drawn = axes.imshow(
            values, cmap="cividis", interpolation="bilinear", vmin=0.0,
            vmax=float(np.nanquantile(values, _MOST)),
            extent=(-half_x, camera.width_px - 1 + half_x, camera.height_px - 1 + half_y, -half_y),
        )  # fmt: skip
        axes.figure.colorbar(drawn, ax=axes, extend="max", label="k=2, px")

    return draw_views("directions", "Error of directions over the picture", shown, draw_view)
