"""`rig history`: the sweeps and calibrations in the database."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.history_result import (
    history_as_dict,
    show_calibrations,
    show_drifts,
    show_sweeps,
)
from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, tell

if TYPE_CHECKING:
    from rig.records import History, HistoryRow, Provenance, StoredCalibration, StoredDrift


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which runs are listed; what is None or empty is not asked."""

    rig: str | None = None
    unit: str | None = None
    since: datetime | None = None
    tag: str | None = None
    is_failed: bool = False

    def among(self, found: "History") -> "History":
        """Return those of all runs; what is damaged stays named, whatever is asked."""
        return replace(
            found,
            sweeps=tuple(row for row in found.sweeps if self.has_sweep(row)),
            calibrations=tuple(row for row in found.calibrations if self.has_calibration(row)),
            drifts=tuple(row for row in found.drifts if self.has_drift(row)),
        )

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
    listed = wanted.among(found)
    if as_json:
        show_json(history_as_dict(listed, where))
        return
    show(where)
    show_calibrations(listed.calibrations)
    show_drifts(listed.drifts)
    show_sweeps(listed.sweeps, is_empty=not found.sweeps)
    for row in found.damaged:
        tell(f"rig: {row.table} {row.number} is damaged and left out: {row.found}")
    if found.sweeps:
        tell_next("history", as_json=False)


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


def newest_as_dict(found: "History", where: str, rig: str | None, count: int) -> dict[str, object]:
    """Return what programs are told of the newest sweeps, calibrations and looks at scenes.

    Args:
        found: all that is stored.
        where: the database.
        rig: only of this rig; None for all.
        count: so many of each.
    """
    of_rig = Wanted(rig).among(found)
    newest = replace(
        of_rig,
        sweeps=of_rig.sweeps[-count:],
        calibrations=of_rig.calibrations[-count:],
        drifts=of_rig.drifts[-count:],
    )
    return history_as_dict(newest, where)
