"""Fields over the picture: what the lens does, and how sure depth is."""

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.depth_error import depth_sigma_mm
from rig.geometry.camera_model import CameraModel
from rig.report.calibration.shown import ShownCalibration
from rig.report.calibration.view_panels import draw_views
from rig.report.figures import BLACK, BLUE, GREY, Axes, Figure, draw_svg, panels

_ACROSS, _DOWN = 33, 25
_ARROWS = 4
_ARROW_SHARE = 0.06
_MOST = 0.95
"""Quantile at which the colours of the depth error end: a few corners must not hide the rest."""
_DISTANCES_MM = (500.0, 1000.0, 3000.0)


def distortion_figure(shown: ShownCalibration) -> str:
    """Shift of every pixel by the lens: exaggerated arrows, and lines of equal shift in px."""

    def draw_view(axes: Axes, view: int) -> None:
        camera = shown.calibration.geometry.cameras[view]
        x, y, shift = _lens_shift_px(camera)
        length = np.hypot(*np.moveaxis(shift, -1, 0))
        if float(np.nanmax(length)) > 0.0:
            lines = axes.contour(x, y, length, levels=6, colors=BLACK, linewidths=0.6)
            axes.clabel(lines, fontsize=6.5, fmt="%g px")
        part = (slice(2, None, _ARROWS), slice(2, None, _ARROWS))
        arrows = shift[part]
        zoom = _ARROW_SHARE * camera.width_px / max(float(np.nanmax(np.abs(arrows))), 1e-9)
        if float(np.nanmax(length)) > 0.0:
            axes.quiver(
                x[part], y[part], *np.moveaxis(zoom * arrows, -1, 0),
                angles="xy", scale_units="xy", scale=1.0, width=0.004, color=BLUE,
            )  # fmt: skip
            axes.text(
                0.01, 0.02, f"arrows × {zoom:.1f}", transform=axes.transAxes, fontsize=7.0,
                color=GREY,
            )  # fmt: skip

    return draw_views("distortion", "Distortion field of every lens", shown, draw_view)


def depth_sigma_figure(shown: ShownCalibration) -> str | None:
    """Error of depth by the calibration, k=2, over the picture; None without a covariance."""
    geometry = shown.calibration.geometry
    if geometry.covariance is None:
        return None
    camera = geometry.cameras[geometry.reference]
    x, y = _pixel_grid(camera)
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)
    maps = [200.0 * depth_sigma_mm(geometry, d, pixels).reshape(x.shape) / d for d in _DISTANCES_MM]
    if not any(np.isfinite(m).any() for m in maps):
        return None

    def draw(figure: Figure) -> None:
        [row] = panels(figure, 1, len(maps), top_in=0.26, room_for_labels=False)
        for axes, values, distance_mm in zip(row, maps, _DISTANCES_MM, strict=True):
            half_x, half_y = (0.5 * (g.flat[-1] - g.flat[0]) / (n - 1) for g, n in
                              ((x, _ACROSS), (y, _DOWN)))  # fmt: skip
            shown_map = axes.imshow(
                values, cmap="cividis", interpolation="bilinear", vmin=0.0,
                vmax=float(np.nanquantile(values, _MOST)),
                extent=(-half_x, x.flat[-1] + half_x, y.flat[-1] + half_y, -half_y),
            )  # fmt: skip
            axes.set(
                title=f"{distance_mm / 1000:g} m: k=2, % of depth",
                xticks=[],
                yticks=[],
                aspect="equal",
            )
            axes.set_facecolor("#dcdcdc")
            axes.grid(visible=False)
            figure.colorbar(shown_map, ax=axes, orientation="horizontal", pad=0.05, extend="max")

    return draw_svg("sigma", "Error of depth over the picture", 2.5, draw)


def _pixel_grid(camera: CameraModel) -> tuple[Float, Float]:
    x, y = np.meshgrid(
        np.linspace(0.0, camera.width_px - 1.0, _ACROSS),
        np.linspace(0.0, camera.height_px - 1.0, _DOWN),
    )
    return x, y


def _lens_shift_px(camera: CameraModel) -> tuple[Float, Float, Float]:
    """Pixels of the ideal pinhole, and the (rows, columns, 2) way from there to the true pixel."""
    x, y = _pixel_grid(camera)
    points = np.stack(
        [
            (x.ravel() - camera.cx_px) / camera.fx_px,
            (y.ravel() - camera.cy_px) / camera.fy_px,
            np.ones(x.size),
        ],
        axis=1,
    )
    shift = camera.project(points) - np.stack([x.ravel(), y.ravel()], axis=1)
    return x, y, shift.reshape(*x.shape, 2)
