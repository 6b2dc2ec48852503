"""Puts the report at its place."""

from pathlib import Path
from typing import TYPE_CHECKING

from rig.disk import disk_explained
from rig.files import put_in_place
from rig.report.extra import report_extra

if TYPE_CHECKING:
    from rig.database import Store
    from rig.report.calibration.lenslets import ShownLenslets
    from rig.report.calibration.shown import ShownCalibration
    from rig.sweep.conclude import SweepResult


def write_report(store: "Store", result: "SweepResult") -> Path:
    """Write the report of a sweep to `result.report`: there completely or not at all.

    The same result of the same sweep gives the same bytes.

    Args:
        store: where the sweep and its frames are.
        result: what the sweep is worth.

    Returns:
        Path of the HTML file.

    Raises:
        ConfigError: the extra `report` is not installed.
        StoreError: a frame is missing or damaged, or the file cannot be written.
    """
    with report_extra(f"the report of sweep {result.sweep_id}", f"rig report {result.sweep_id}"):
        # Here, because plot library and mathematics take a second to import.
        from rig.report.page import report_html  # noqa: PLC0415
    _write(result.report, report_html(store, result))
    return result.report


def write_calibration_page(path: Path, shown: "ShownCalibration") -> Path:
    """Write the page of a geometric calibration: there completely or not at all.

    Args:
        path: the HTML file.
        shown: the calibration, and pictures of it that are at hand.

    Returns:
        `path`.

    Raises:
        ConfigError: the extra `report` is not installed.
        StoreError: the file cannot be written.
    """
    with report_extra(f"the page of a calibration of {shown.rig}", "calibrate again"):
        from rig.report.calibration.page import calibration_html  # noqa: PLC0415
    _write(path, calibration_html(shown))
    return path


def write_lenslet_page(path: Path, shown: "ShownLenslets") -> Path:
    """Write the page of a calibration of lenslets: there completely or not at all.

    Args:
        path: the HTML file.
        shown: the calibration, and its white picture.

    Returns:
        `path`.

    Raises:
        ConfigError: the extra `report` is not installed.
        StoreError: the file cannot be written.
    """
    with report_extra(f"the page of a calibration of {shown.rig}", "calibrate again"):
        from rig.report.calibration.lenslet_page import lenslet_html  # noqa: PLC0415
    _write(path, lenslet_html(shown))
    return path


def _write(path: Path, text: str) -> None:
    with disk_explained("write the report", path):
        put_in_place(path, text.encode())
