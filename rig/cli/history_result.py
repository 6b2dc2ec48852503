"""What `rig history` tells of sweeps, calibrations and looks at scenes: tables, and JSON."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rig.cli.output import show, table
from rig.secrets import value_without_secrets

if TYPE_CHECKING:
    from rig.records import History, HistoryRow, Provenance, StoredCalibration, StoredDrift

_WHEN = "%Y-%m-%d %H:%M %Z"


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
        case "failed" if row.pruned:
            return "sweep again: its frames were pruned"
        case "failed" if row.stops_done < row.stops_planned:
            return f"put the cause right, then {go_on}"
        case "failed":
            return f"rig fit {row.id} says why it has no curve; put that right, and sweep again"


def history_as_dict(found: "History", where: str) -> dict[str, object]:
    """Return what programs are told of a history, and of the database that holds it."""
    return {
        "database": where,
        "sweeps": [
            {
                "sweep": row.id,
                "rig": row.rig,
                "unit": row.unit,
                "started_at": row.started_at.isoformat(),
                "ended_at": None if row.ended_at is None else row.ended_at.isoformat(),
                "state": row.state,
                "at_work": row.at_work,
                "next": next_step(row),
                "stops_done": row.stops_done,
                "stops_planned": row.stops_planned,
                "samples": row.samples,
                "pruned": row.pruned,
                "missing": row.missing,
                "curve": row.curve_id,
                "curve_active": row.is_active,
                "holdout_rms_pct": row.holdout_rms_pct,
                "rows_rms_px": row.rows_rms_px,
                "note": row.note,
                **_provenance(row.provenance),
                "devices": value_without_secrets(row.devices),
                "versions": row.versions,
            }
            for row in found.sweeps
        ],
        "calibrations": [
            {
                "calibration": row.id,
                "rig": row.rig,
                "unit": row.unit,
                "created_at": row.created_at.isoformat(),
                "active": row.active,
                "quality": row.quality,
                "note": row.note,
                **_provenance(row.provenance),
            }
            for row in found.calibrations
        ],
        "drifts": [_drift_as_dict(row) for row in found.drifts],
        "damaged": [
            {"table": row.table, "row": row.number, "found": row.found} for row in found.damaged
        ],
    }


def _drift_as_dict(row: "StoredDrift") -> dict[str, object]:
    return {
        "drift": row.id,
        "rig": row.rig,
        "unit": row.unit,
        "calibration": row.calibration_id,
        "measured_at": row.measured_at.isoformat(),
        "temperature_degc": row.temperature_degc,
        **row.details,
    }


def _provenance(made: "Provenance") -> dict[str, object]:
    return {"user": made.user, "host": made.host, "command": made.command, "tags": list(made.tags)}


def show_calibrations(calibrations: "Sequence[StoredCalibration]") -> None:
    """Show calibrations, oldest first; nothing where there are none."""
    if not calibrations:
        return
    cells = [
        [
            str(row.id),
            row.rig,
            row.unit,
            row.created_at.astimezone().strftime(_WHEN),
            "" if row.active else "not taken by itself",
            _source(row),
            _words(row.note, row.provenance),
        ]
        for row in calibrations
    ]
    _show_known(cells, ("calibration", "rig", "unit", "made", "state", "source", "note"))
    show()


def _source(row: "StoredCalibration") -> str:
    """Say where a calibration comes from, where it is not from a target."""
    from rig.run import FROM_SCENE

    if FROM_SCENE in row.quality:
        return "from a scene, lengths by the pitch"
    return f"from {row.quality['imported']}" if "imported" in row.quality else ""


def show_drifts(rows: "Sequence[StoredDrift]") -> None:
    """Show what scenes told since, look after look."""
    if not rows:
        return
    cells = [
        [
            str(row.id),
            row.rig,
            row.unit,
            row.measured_at.astimezone().strftime(_WHEN),
            str(row.calibration_id),
            "" if row.temperature_degc is None else f"{row.temperature_degc:.1f}",
            *_turns(row),
        ]
        for row in rows
    ]
    header = ("scene", "rig", "unit", "looked", "calibration", "degC", "rows moved px", "chance")
    _show_known(cells, header)
    show()


def _turns(row: "StoredDrift") -> list[str]:
    """How far rows have moved, and whether that may be chance; nothing where it is not told."""
    rows_px, probability = row.details.get("rows_px"), row.details.get("probability")
    return [
        f"{rows_px:.3f}" if isinstance(rows_px, float) else "",
        f"{probability:.2g}" if isinstance(probability, float) else "",
    ]


def show_sweeps(rows: "Sequence[HistoryRow]", *, is_empty: bool) -> None:
    """Show sweeps, oldest first; `is_empty` says that the database holds none at all."""
    if not rows:
        show("no sweep yet; begin with: rig sweep PROFILE" if is_empty else "no such sweep")
        return
    cells = [
        [
            str(row.id),
            row.rig,
            row.unit,
            row.started_at.astimezone().strftime(_WHEN),
            row.state,
            f"{row.stops_done}/{row.stops_planned}",
            str(row.samples),
            _frames(row),
            "" if row.curve_id is None else str(row.curve_id),
            "" if row.holdout_rms_pct is None else f"{row.holdout_rms_pct:.4f}",
            "" if row.rows_rms_px is None else f"{row.rows_rms_px:.2f}",
            _words(row.note, row.provenance),
            next_step(row),
        ]
        for row in rows
    ]
    header = (
        *("sweep", "rig", "unit", "started", "state", "stops", "samples", "frames", "curve"),
        *("held-out rms %", "rows miss px", "note", "what to do next"),
    )
    _show_known(cells, header)


def _frames(row: "HistoryRow") -> str:
    """Say what is not on the disk; nothing where all of it is."""
    said = [f"{row.missing} missing"] if row.missing else []
    return ", ".join([*said, *([f"{row.pruned} pruned"] if row.pruned else [])])


def _words(note: str, made: "Provenance") -> str:
    return " ".join([note, *(f"#{tag}" for tag in made.tags)]).strip()


_OFTEN_EMPTY = ("unit", "frames", "note")


def _show_known(cells: list[list[str]], header: tuple[str, ...]) -> None:
    """Show a table without the columns that say nothing of any row."""
    kept = [
        place
        for place, name in enumerate(header)
        if name not in _OFTEN_EMPTY or any(row[place] for row in cells)
    ]
    rows = [[row[place] for place in kept] for row in cells]
    for line in table(rows, [header[place] for place in kept]):
        show(line)
