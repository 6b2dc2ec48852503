"""`rig history`: the sweeps and calibrations in the database."""

from typing import TYPE_CHECKING

from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, table

if TYPE_CHECKING:
    from rig.records import StoredCalibration


def history(*, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List the sweeps and calibrations in the database, oldest first."""
    from rig.database import open_store

    with open_store(database, absent="refused") as store:
        rows, calibrations, where = store.sweeps(), store.calibrations(), store.database
    if as_json:
        show_json(
            {
                "database": where,
                "sweeps": [
                    {
                        "sweep": row.id,
                        "rig": row.rig,
                        "started_at": row.started_at.isoformat(),
                        "state": row.state,
                        "stops_done": row.stops_done,
                        "stops_planned": row.stops_planned,
                        "samples": row.samples,
                        "curve": row.curve_id,
                        "holdout_rms_pct": row.holdout_rms_pct,
                        "rows_rms_px": row.rows_rms_px,
                    }
                    for row in rows
                ],
                "calibrations": [
                    {
                        "calibration": row.id,
                        "rig": row.rig,
                        "created_at": row.created_at.isoformat(),
                        "active": row.active,
                        "quality": row.quality,
                    }
                    for row in calibrations
                ],
            }
        )
        return
    show(where)
    _show_calibrations(calibrations)
    if not rows:
        show("no sweep yet; begin with: rig sweep PROFILE")
        return
    cells = [
        [
            str(row.id),
            row.rig,
            row.started_at.astimezone().strftime("%Y-%m-%d %H:%M"),
            row.state,
            f"{row.stops_done}/{row.stops_planned}",
            str(row.samples),
            "" if row.curve_id is None else str(row.curve_id),
            "" if row.holdout_rms_pct is None else f"{row.holdout_rms_pct:.4f}",
            "" if row.rows_rms_px is None else f"{row.rows_rms_px:.2f}",
        ]
        for row in rows
    ]
    header = (
        *("sweep", "rig", "started", "state", "stops", "samples", "curve"),
        *("held-out rms %", "rows miss px"),
    )
    for line in table(cells, header):
        show(line)


def _show_calibrations(calibrations: "tuple[StoredCalibration, ...]") -> None:
    if not calibrations:
        return
    cells = [
        [
            str(row.id),
            row.rig,
            row.created_at.astimezone().strftime("%Y-%m-%d %H:%M"),
            "" if row.active else "not taken by itself",
            f"from {row.quality['imported']}" if "imported" in row.quality else "",
        ]
        for row in calibrations
    ]
    for line in table(cells, ("calibration", "rig", "made", "state", "source")):
        show(line)
    show()
