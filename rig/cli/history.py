"""`rig history`: the sweeps and calibrations in the database."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, table, tell
from rig.secrets import value_without_secrets

if TYPE_CHECKING:
    from rig.records import History, HistoryRow, Provenance, StoredCalibration, StoredDrift

_WHEN = "%Y-%m-%d %H:%M %Z"


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which runs are listed; what is None or empty is not asked."""

    rig: str | None = None
    unit: str | None = None
    since: datetime | None = None
    tag: str | None = None
    is_failed: bool = False

    def has(self, rig: str, unit: str, begun_at: datetime, provenance: "Provenance") -> bool:
        """Tell whether a run is one of them, as far as this tells."""
        return (
            self.rig in (None, rig)
            and self.unit in (None, unit)
            and (self.since is None or begun_at >= self.since)
            and (self.tag is None or self.tag in provenance.tags)
        )

    def has_sweep(self, row: "HistoryRow") -> bool:
        """Tell whether a sweep is one of them."""
        missed = row.curve_id is not None and not row.is_active
        is_bad = row.state == "failed" or missed
        is_meant = self.has(row.rig, row.unit, row.started_at, row.provenance)
        return is_meant and (is_bad or not self.is_failed)

    def has_calibration(self, row: "StoredCalibration") -> bool:
        """Tell whether a calibration is one of them."""
        is_meant = self.has(row.rig, row.unit, row.created_at, row.provenance)
        return is_meant and not (self.is_failed and row.active)

    def has_drift(self, row: "StoredDrift") -> bool:
        """Tell whether a look at a scene is one of them; those have no tags and do not fail."""
        is_asked = self.tag is None and not self.is_failed
        is_since = self.since is None or row.measured_at >= self.since
        is_mine = self.rig in (None, row.rig) and self.unit in (None, row.unit)
        return is_asked and is_since and is_mine


def history(
    *,
    rig: Annotated[
        str | None, typer.Option("--rig", metavar="NAME", help="Only of this rig.")
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option("--unit", metavar="UNIT", help="Only of this one of the rigs of a name."),
    ] = None,
    since: Annotated[
        str | None,
        typer.Option(
            "--since",
            metavar="DATE|DAYSd",
            help="Only since then: 2026-07-01, 2026-07-01T12:00, or 7d for the last seven days.",
        ),
    ] = None,
    tag: Annotated[
        str | None, typer.Option("--tag", metavar="WORD", help="Only with this tag.")
    ] = None,
    failed: Annotated[
        bool, typer.Option("--failed", help="Only what failed or missed a quality gate.")
    ] = False,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """List the sweeps and calibrations in the database, oldest first.

    A row that is damaged is named, and hides no other; what is missing on the disk is marked.
    """
    from rig.database import open_store

    begun_at = None if since is None else _moment(since)
    wanted = Wanted(rig, unit, begun_at, tag, is_failed=failed)
    with open_store(database, absent="refused") as store:
        found, where = store.history(store.frames), store.database
    sweeps = [row for row in found.sweeps if wanted.has_sweep(row)]
    calibrations = [row for row in found.calibrations if wanted.has_calibration(row)]
    drifts = [row for row in found.drifts if wanted.has_drift(row)]
    if as_json:
        show_json(_as_dict(where, sweeps, calibrations, drifts, found))
        return
    show(where)
    _show_calibrations(calibrations)
    _show_drifts(drifts)
    _show_sweeps(sweeps, is_empty=not found.sweeps)
    for row in found.damaged:
        tell(f"rig: {row.table} {row.number} is damaged and left out: {row.found}")
    if found.sweeps:
        tell_next("history", as_json=False)


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


def _show_drifts(rows: "list[StoredDrift]") -> None:
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


def _moment(text: str) -> datetime:
    """Return the moment that `--since` names; one without a zone is of this machine's."""
    try:
        if text.endswith("d"):
            return datetime.now(UTC) - timedelta(days=float(text[:-1]))
        return datetime.fromisoformat(text).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise typer.BadParameter(
            f"--since {text!r}: write 2026-07-01, 2026-07-01T12:00+02:00, or 7d"
        ) from error


def _as_dict(
    where: str,
    sweeps: "list[HistoryRow]",
    calibrations: "list[StoredCalibration]",
    drifts: "list[StoredDrift]",
    found: "History",
) -> Mapping[str, object]:
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
            for row in sweeps
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
            for row in calibrations
        ],
        "drifts": [_drift_as_dict(row) for row in drifts],
        "damaged": [
            {"table": row.table, "row": row.number, "found": row.found} for row in found.damaged
        ],
    }


def _provenance(made: "Provenance") -> dict[str, object]:
    return {"user": made.user, "host": made.host, "command": made.command, "tags": list(made.tags)}


def _show_sweeps(rows: "list[HistoryRow]", *, is_empty: bool) -> None:
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


def _show_calibrations(calibrations: "list[StoredCalibration]") -> None:
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


def newest_as_dict(found: "History", where: str, rig: str | None, count: int) -> dict[str, object]:
    """Return what programs are told of the newest sweeps, calibrations and looks at scenes.

    Args:
        found: all that is stored.
        where: the database.
        rig: only of this rig; None for all.
        count: so many of each.
    """
    sweeps = [row for row in found.sweeps if rig in (None, row.rig)][-count:]
    calibrations = [row for row in found.calibrations if rig in (None, row.rig)][-count:]
    drifts = [row for row in found.drifts if rig in (None, row.rig)][-count:]
    return dict(_as_dict(where, sweeps, calibrations, drifts, found))
