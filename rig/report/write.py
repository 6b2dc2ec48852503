"""Puts the report at its place."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from rig.database.trouble import explained
from rig.errors import ConfigError

if TYPE_CHECKING:
    from rig.database import Store
    from rig.sweep.conclude import SweepResult

_EXTRA = ("matplotlib", "jinja2")


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
    try:
        # Here, because plot library and mathematics take a second to import.
        from rig.report.page import report_html  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in _EXTRA:
            raise
        raise ConfigError(
            f"asked for the report of sweep {result.sweep_id}, {error.name} is not installed; "
            f"pip install 'epirig[report]', then rig report {result.sweep_id}"
        ) from error
    _write_atomically(result.report, report_html(store, result))
    return result.report


def _write_atomically(path: Path, text: str) -> None:
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with explained("write the report", path):
        try:
            beside.write_text(text, encoding="utf-8")
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
