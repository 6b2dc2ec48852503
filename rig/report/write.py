"""Puts the report at its place."""

import os
from pathlib import Path

from rig.database import Store
from rig.database.trouble import explained
from rig.errors import ConfigError
from rig.report.evidence import gather
from rig.sweep.conclude import SweepResult

_EXTRA = ("matplotlib", "jinja2")


def write_report(store: Store, result: SweepResult) -> Path:
    """Write the report of a sweep to `result.report`: there completely or not at all.

    The same sweep and curve give the same bytes.

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
        # Here, because the plot library alone takes half a second to import.
        from rig.report.page import render_page  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in _EXTRA:
            raise
        raise ConfigError(
            f"asked for the report of sweep {result.sweep_id}, {error.name} is not installed; "
            f"pip install 'epirig[report]', then rig report {result.sweep_id}"
        ) from error
    _write_atomically(result.report, render_page(gather(store, result)))
    return result.report


def _write_atomically(path: Path, text: str) -> None:
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with explained("write the report", path):
        try:
            beside.write_text(text, encoding="utf-8")
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
