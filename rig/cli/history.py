"""`rig history`: the sweeps and calibrations in the database."""

from typing import TYPE_CHECKING

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, table

if TYPE_CHECKING:
    from rig.records import HistoryRow, StoredCalibration


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
                        "at_work": row.at_work,
                        "next": next_step(row),
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
            next_step(row),
        ]
        for row in rows
    ]
    header = (
        *("sweep", "rig", "started", "state", "stops", "samples", "curve"),
        *("held-out rms %", "rows miss px", "what to do next"),
    )
    for line in table(cells, header):
        show(line)
    tell_next("history", as_json=False)


def next_step(row: "HistoryRow") -> str:
    """Say what to do next with a sweep, by what is stored of it."""
    go_on = f"rig sweep {row.rig} --resume {row.id}"
    if row.at_work is not None:
        return f"let it end: {row.at_work}"
    match row.state:
        case "taking":
            return go_on
        case "taken":
            return f"{go_on} (concludes it, without devices)"
        case "concluded":
            return f"rig report {row.id}"
        case "failed" if row.stops_done < row.stops_planned:
            return f"put the cause right, then {go_on}"
        case "failed":
            return f"rig fit {row.id} says why it has no curve; put that right, and sweep again"


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
