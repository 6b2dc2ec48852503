"""The part of the store that looks at all of it: for operators, not for runs."""

import sqlite3
from collections.abc import Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import cast

from sqlalchemy import select, text, update
from sqlalchemy.orm import Session

from rig.database import queries, row_check
from rig.database.convert import calibration_value, drift_value
from rig.database.copying import copied_rows, copy_rows, is_empty
from rig.database.history_rows import history_rows
from rig.database.leases import LeaseShelf, sweep_lease
from rig.database.schema import writing
from rig.database.tables import CalibrationRow, DriftRow, LeaseRow, SampleRow, SweepRow
from rig.database.trouble import explained
from rig.records import DamagedRow, History


@dataclass(frozen=True, slots=True)
class SampleFiles:
    """Which files a sample should have."""

    sweep_id: int
    folder: str
    """Below the root of all frames."""
    is_pruned: bool
    sha256: Mapping[str, str]
    """By name of the file."""


class UpkeepShelf(LeaseShelf):
    """What is there, as a whole; damaged rows are named and hide no other."""

    def history(self, frames: Path) -> History:
        """Return every sweep and calibration that can be read, oldest first, and what cannot.

        Args:
            frames: root of all frames, where missing folders are looked for.
        """
        at_work = {what: str(owner) for what, owner in self.owners().items()}
        with self._reading("list the sweeps") as session:
            good: dict[str, list[int]] = {}
            damaged: list[DamagedRow] = []
            for name in ("sweeps", "curves", "calibrations", "drifts"):
                good[name], bad = _readable(session, name)
                damaged += bad
            by_sweep = {
                number: at_work[sweep_lease(number)]
                for number in good["sweeps"]
                if sweep_lease(number) in at_work
            }
            rows = history_rows(session, by_sweep, good["sweeps"], good["curves"])
            missing = _missing(_sample_places(session), frames)
            kept = select(CalibrationRow).where(CalibrationRow.id.in_(good["calibrations"]))
            calibrations = session.scalars(kept.order_by(CalibrationRow.id)).all()
            seen = select(DriftRow).where(DriftRow.id.in_(good["drifts"]))
            looks = session.scalars(seen.order_by(DriftRow.id)).all()
            return History(
                tuple(replace(row, missing=missing.get(row.id, 0)) for row in rows),
                tuple(calibration_value(row) for row in calibrations),
                tuple(damaged),
                tuple(drift_value(row) for row in looks),
            )

    def damaged_rows(self) -> tuple[DamagedRow, ...]:
        """Return every row that cannot be read or refers to nothing, and damage of the file."""
        with self._reading("look at every row") as session:
            return (*_damage_of_file(session), *row_check.damaged_rows(session))

    def sample_files(self) -> tuple[SampleFiles, ...]:
        """Return which files all samples should have, of rows that can be read."""
        with self._reading("list the frames") as session:
            return tuple(_sample_files(session))

    def sample_places(self) -> tuple[SampleFiles, ...]:
        """Return the same without the files: much quicker."""
        with self._reading("list the samples") as session:
            return tuple(_sample_places(session))

    def sweep_folders(self) -> dict[str, int]:
        """Return the number of the sweep of every folder below the root of all frames."""
        with self._reading("list the folders of sweeps") as session:
            rows = row_check.raw_rows(session, row_check.table_of("sweeps"))
            return {str(row["folder"]): cast("int", row["id"]) for row in rows}

    @contextmanager
    def nothing_begins(self) -> Generator[dict[str, int]]:
        """Keep sweeps from beginning; gives the folders of those that there are.

        Raises:
            StoreError: the database takes nothing.
        """
        with self._writing("look whose folder it is") as session:
            if session.get_bind().dialect.name == "postgresql":
                session.execute(text("LOCK TABLE sweeps IN SHARE ROW EXCLUSIVE MODE"))
            rows = session.execute(select(SweepRow.folder, SweepRow.id))
            yield {folder: number for folder, number in rows}  # noqa: C416  (typed as pairs)

    def mark_pruned(self, sweep_id: int) -> int:
        """Write down that the frames of a sweep go; from then on nobody misses them.

        Args:
            sweep_id: a sweep that this program owns.

        Returns:
            How many samples had frames until now.

        Raises:
            OwnedError: another program works on it.
        """
        with self._writing(f"prune sweep {sweep_id}") as session:
            self._require_owned(session, sweep_lease(sweep_id))
            mine = (SampleRow.sweep_id == sweep_id, SampleRow.pruned_at.is_(None))
            numbers = session.scalars(select(SampleRow.id).where(*mine)).all()
            now = datetime.now(UTC)
            session.execute(update(SampleRow).where(*mine).values(pruned_at=now))
            return len(numbers)

    def newest_curve(self, sweep_id: int) -> int | None:
        """Return the number of the newest curve of a sweep, None where it has none."""
        with self._reading(f"look for the curve of sweep {sweep_id}") as session:
            return queries.newest_curve_id(session, sweep_id)

    def write_copy(self, file: Path) -> None:
        """Write all rows as they are now into a new SQLite file; who works goes on.

        No lease is in it: whoever works here works on this store, not on the copy.

        Args:
            file: is not there.

        Raises:
            StoreError: it cannot be written, or a row cannot be read.
        """
        with explained("write a copy of the database", file):
            if self._engine.dialect.name == "sqlite":
                self._require_readable()
                original = self._engine.raw_connection()
                try:
                    with closing(sqlite3.connect(file)) as copy:
                        cast("sqlite3.Connection", original.driver_connection).backup(copy)
                        copy.execute(f"DELETE FROM {LeaseRow.__tablename__}")  # noqa: S608
                        copy.commit()
                        copy.execute("PRAGMA journal_mode = DELETE")
                finally:
                    original.close()
            else:
                with self._engine.connect().execution_options(
                    isolation_level="REPEATABLE READ"
                ) as source:
                    copied_rows(source, file)

    def copy_into(self, other: "UpkeepShelf") -> dict[str, int]:
        """Copy all rows into an empty database: all of them, or none.

        While that lasts nobody else writes into this one. What was written is read back and
        compared, before it counts.

        Args:
            other: open and empty.

        Returns:
            How many rows each table has.

        Raises:
            StoreError: the other is not empty, a row cannot be read, or one came back otherwise.
        """
        with (
            explained("copy the rows", other.database),
            writing(self._engine).begin() as source,
            writing(other._engine).begin() as target,  # noqa: SLF001  (of the same class)
        ):
            return copy_rows(source, target, other.database)

    def is_empty(self) -> bool:
        """Tell whether no table holds a row."""
        with self._reading("look whether it is empty") as session:
            return is_empty(session.connection())

    def _require_readable(self) -> None:
        with self._reading("read the database"):
            return


def _readable(session: Session, name: str) -> tuple[list[int], list[DamagedRow]]:
    table = row_check.table_of(name)
    good: list[int] = []
    bad: list[DamagedRow] = []
    for row in row_check.raw_rows(session, table):
        found = row_check.problem(table, row)
        if found:
            bad.append(DamagedRow(name, row_check.key_of(table, row), found))
        else:
            good.append(cast("int", row["id"]))
    return good, bad


def _sample_files(session: Session) -> Iterator[SampleFiles]:
    frames: dict[object, dict[str, str]] = {}
    good = _good_rows(session, "frames")
    for row in good:
        frames.setdefault(row["sample_id"], {})[f"{row['view']}.png"] = str(row["sha256"])
    for row in _good_rows(session, "samples"):
        yield _with_files(row, frames.get(row["id"], {}))


def _sample_places(session: Session) -> Iterator[SampleFiles]:
    return (_with_files(row, {}) for row in _good_rows(session, "samples"))


def _with_files(row: row_check.RawRow, sha256: Mapping[str, str]) -> SampleFiles:
    is_pruned = row["pruned_at"] is not None
    return SampleFiles(cast("int", row["sweep_id"]), str(row["folder"]), is_pruned, sha256)


def _good_rows(session: Session, name: str) -> Iterator[row_check.RawRow]:
    table = row_check.table_of(name)
    rows = row_check.raw_rows(session, table)
    return (row for row in rows if not row_check.problem(table, row))


def _missing(samples: Iterator[SampleFiles], frames: Path) -> dict[int, int]:
    counts: dict[int, int] = {}
    for sample in samples:
        if not sample.is_pruned and not (frames / sample.folder).is_dir():
            counts[sample.sweep_id] = counts.get(sample.sweep_id, 0) + 1
    return counts


def _damage_of_file(session: Session) -> Iterator[DamagedRow]:
    if session.get_bind().dialect.name != "sqlite":
        return
    for (line,) in session.execute(text("PRAGMA integrity_check")):
        if line != "ok" and not str(line).startswith("CHECK constraint"):  # told with its row
            yield DamagedRow("database", "", str(line))
