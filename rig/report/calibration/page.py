"""The page of a geometric calibration."""

from importlib.resources import files

from rig.geometry.bundle.direction_error import direction_error_of
from rig.report.calibration.corner_plots import corner_figure
from rig.report.calibration.direction_plot import direction_figure
from rig.report.calibration.error_plots import bar_figure, coverage_figure, residual_figure
from rig.report.calibration.field_plots import depth_sigma_figure, distortion_figure
from rig.report.calibration.parameters import parameter_rows
from rig.report.calibration.shown import ShownCalibration
from rig.report.calibration.space_plots import space_figure
from rig.report.page import render_template

TEMPLATE = "calibration.html.j2"


def calibration_html(shown: ShownCalibration) -> str:
    """Return the page as one HTML file that needs nothing else; the same input, the same bytes."""
    calibration = shown.calibration
    tells_directions = (
        len(calibration.geometry.names) == 1 and calibration.geometry.covariance is not None
    )
    outliers = [
        (r.picture, calibration.geometry.names[r.view], int(r.outlier.sum()), len(r.ids))
        for r in calibration.residuals
        if r.outlier.any()
    ]
    return render_template(
        files("rig.report.calibration") / TEMPLATE,
        shown=shown,
        calibration=calibration,
        geometry=calibration.geometry,
        verdict=calibration.verdict,
        directions=direction_error_of(calibration) if tells_directions else None,
        parameters=parameter_rows(calibration.geometry),
        outliers=outliers,
        points=sum(len(r.ids) for r in calibration.residuals),
        figures={
            "corners": corner_figure(shown),
            "bars": bar_figure(shown),
            "residuals": residual_figure(shown),
            "coverage": coverage_figure(shown),
            "distortion": distortion_figure(shown),
            "sigma": None if tells_directions else depth_sigma_figure(shown),
            "directions": direction_figure(shown) if tells_directions else None,
            "space": space_figure(shown),
        },
    )
