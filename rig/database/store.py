"""The store: sweeps, samples with their frames, slopes and curves, kept for good."""

import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from sqlalchemy import URL, Engine

from rig.database import queries
from rig.database.calibrations import CalibrationShelf
from rig.database.convert import (
    frame_row,
    provenance_json,
    sample_value,
    stop_row,
    stop_value,
    sweep_value,
)
from rig.database.curves import CurveShelf
from rig.database.drifts import DriftShelf
from rig.database.frames import (
    FrameWriter,
    clear_unfinished,
    read_frames,
    sample_folder,
    sweep_folder,
)
from rig.database.history_rows import history_rows
from rig.database.leases import Now, database_now, sweep_lease
from rig.database.location import Location, locate
from rig.database.measurements import MeasurementShelf
from rig.database.provenance import this_program
from rig.database.reading import may_only_be_read, open_to_read
from rig.database.schema import empty_engine, open_engine
from rig.database.tables import SampleRow, SweepRow
from rig.database.trouble import explained
from rig.database.upkeep import UpkeepShelf
from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.files import make_new_folder
from rig.frames import MultiView
from rig.plan import Stop
from rig.records import (
    HistoryRow,
    Json,
    Provenance,
    Sample,
    Sweep,
)

Absent = Literal["made", "empty", "refused"]


def open_store(
    url: str | None = None, *, absent: Absent = "made", now: Now = database_now
) -> "Store":
    """Open the database; an old one is upgraded.

    Who only reads can do so from a disk that may only be read.

    Args:
        url: SQLAlchemy URL; else `RIG_DATABASE`, else a file in the user's data directory.
        absent: what becomes of a file that is not there: `made`, for who writes; `empty` reads as
            a database that holds nothing, and nothing is left on the disk; `refused` as well, but
            only in the user's data directory: a name that somebody gave is an error.
        now: tells the time by which owners of sweeps are judged.

    Raises:
        StoreError: it cannot be opened, is not ours, is newer than this program, or is not there.
    """
    location = locate(url, os.environ)
    if absent != "made" and may_only_be_read(location):
        return Store(location, open_to_read(location), now=now)
    if absent == "made" or location.file is None or _holds_something(location.file):
        return Store(location, open_engine(location), now=now)
    if absent == "refused" and (url or os.environ.get("RIG_DATABASE")):
        raise StoreError(
            f"asked to read the database {location}, there is none",
            advice="look at --db and RIG_DATABASE, or make it with rig sweep or rig calibrate",
        )
    return Store(location, empty_engine(), exists=False)


def open_at(location: Location) -> "Store":
    """Open, or make, the database of a location that was decided before.

    Raises:
        StoreError: it cannot be opened, is not ours, or is newer than this program.
    """
    if may_only_be_read(location):
        return Store(location, open_to_read(location))
    return Store(location, open_engine(location))


def store_at(file: Path, frames: Path, modes: FileModes) -> "Store":
    """Open, or make, the database in a file, with the frames in a folder that is named as well.

    Args:
        file: of SQLite.
        frames: root of all frames, whatever `RIG_FRAMES` says.
        modes: permission bits of what is made.

    Raises:
        StoreError: it cannot be opened, is not ours, or is newer than this program.
    """
    return open_at(Location(URL.create("sqlite", database=str(file)), frames, modes))


def _holds_something(file: Path) -> bool:
    return file.is_file() and file.stat().st_size > 0


class Store(CalibrationShelf, DriftShelf, MeasurementShelf, CurveShelf, UpkeepShelf):
    """One open database; a context manager, safe to use from several threads.

    Every method is one short transaction of its own: done when it returns, undone when it raises.
    All of them raise `StoreError` when disk or database fail; what was stored before stays.
    """

    def __init__(
        self,
        location: Location,
        engine: Engine,
        *,
        exists: bool = True,
        now: Now = database_now,
    ) -> None:
        super().__init__(location, engine, now)
        self.location = location
        """Where it is."""
        self.frames = location.frames
        """Folder below which all frames are."""
        self.exists = exists
        """False where there is no database yet: this one holds nothing, and keeps nothing."""

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the database."""
        self._engine.dispose()

    def require_writable(self) -> None:
        """Begin a transaction that writes, and end it; nothing is changed.

        Raises:
            StoreError: the database takes nothing.
        """
        with self._writing("write") as session:
            session.connection()

    def create_sweep(
        self,
        *,
        rig: str,
        profile: Json,
        stops: Sequence[Stop],
        samples_per_stop: int,
        versions: Json,
        devices: Json,
        note: str = "",
        calibration_id: int | None = None,
        unit: str = "",
        provenance: Provenance | None = None,
    ) -> int:
        """Begin a sweep: its row, its plan and its frame folder.

        Args:
            rig: name of the rig, which names its folder as well.
            profile: the whole profile as JSON data, as from `model_dump(mode="json")`.
            stops: the plan, in the order of visits.
            samples_per_stop: how many samples make a stop done.
            versions: see `software_versions`.
            devices: identity of camera and stage.
            note: free text of the user.
            calibration_id: geometric calibration that its slopes will be measured with.
            unit: which of the rigs of this name; empty where nobody knows.
            provenance: who makes it; None for this program.

        Returns:
            The id of the sweep; its state is `taking`.
        """
        started_at = datetime.now(UTC)
        with self._writing("begin a sweep") as session:
            self._require_alone(session, "", f"asked to begin a sweep of {rig}")
            row = SweepRow(
                rig=rig,
                profile=dict(profile),
                versions=dict(versions),
                devices=dict(devices),
                samples_per_stop=samples_per_stop,
                started_at=started_at,
                state="taking",
                folder="",
                note=note,
                calibration_id=calibration_id,
                unit=unit,
                provenance=provenance_json(provenance or this_program()),
                stops=[stop_row(stop) for stop in stops],
            )
            session.add(row)
            session.flush()
            folder = self.frames / sweep_folder(rig, row.id, started_at)
            with explained("begin a sweep", folder):
                # One that was killed before its row counted left a folder of this number.
                folder = make_new_folder(folder, self.modes.folder)
            row.folder = folder.relative_to(self.frames).as_posix()
            return row.id

    @contextmanager
    def owned_sweep(self, sweep_id: int, asked: str) -> Generator[None]:
        """Be the only program that works on a sweep; see `owned`.

        Raises:
            OwnedError: another program works on it; names that one, and nothing was changed.
            StoreError: no such sweep, or its folder is gone.
        """
        sweep = self.sweep(sweep_id)
        with self.owned(sweep_lease(sweep_id), sweep.folder, asked):
            yield

    def reopen_sweep(self, sweep_id: int) -> Sweep:
        """Set a sweep that stopped early to `taking` again, to add what is missing.

        Raises:
            OwnedError: another program works on it.
            StoreError: no such sweep, or it is concluded.
        """
        with self._writing(f"resume sweep {sweep_id}") as session:
            self._require_owned(session, sweep_lease(sweep_id))
            row = queries.sweep_row(session, sweep_id)
            if row.state == "concluded":
                raise StoreError(
                    f"asked to resume sweep {sweep_id}, it is concluded",
                    advice=f"begin a new one; rig report {sweep_id} writes its report again",
                )
            row.state, row.ended_at = "taking", None
            if queries.is_whole(session, row):
                row.state, row.ended_at = "taken", self._now(session)
            pruned = queries.pruned_count(session, sweep_id)
            if pruned:
                raise StoreError(
                    f"asked to resume sweep {sweep_id}, the frames of {pruned} of its samples were "
                    "pruned",
                    advice="begin a new one",
                )
            sweep = sweep_value(row, self.frames)
        clear_unfinished(sweep.folder)
        return sweep

    def stop_sweep(self, sweep_id: int, *, failed: bool) -> None:
        """Write down that and when a sweep ended before it was concluded.

        Args:
            sweep_id: the sweep.
            failed: whether an error ended it; without one it was interrupted, and what is still
                to do is as it was.

        Raises:
            OwnedError: another program works on it.
            StoreError: no such sweep.
        """
        with self._writing(f"end sweep {sweep_id}") as session:
            self._require_owned(session, sweep_lease(sweep_id))
            row = queries.sweep_row(session, sweep_id)
            row.ended_at = self._now(session)
            if failed and row.state != "concluded":
                row.state = "failed"

    def sweep(self, sweep_id: int) -> Sweep:
        """Return one sweep.

        Raises:
            StoreError: no such sweep; the message names those that there are.
        """
        with self._reading(f"read sweep {sweep_id}") as session:
            return sweep_value(queries.sweep_row(session, sweep_id), self.frames)

    def last_resumable_sweep(self, rig: str) -> Sweep:
        """Return the newest sweep of a rig, if it is not concluded.

        Older ones are left alone: the newer one has taken their place. They can still be resumed
        by their id.

        Raises:
            StoreError: there is none, or the newest is concluded.
        """
        with self._reading(f"look for a sweep of {rig}") as session:
            return sweep_value(queries.newest_unfinished_sweep_row(session, rig), self.frames)

    def sweeps(self) -> tuple[HistoryRow, ...]:
        """Return all sweeps, oldest first, with how far they came."""
        at_work = {what: str(owner) for what, owner in self.owners().items()}
        with self._reading("list the sweeps") as session:
            by_sweep = {
                sweep_id: at_work[sweep_lease(sweep_id)]
                for sweep_id in queries.sweep_ids(session)
                if sweep_lease(sweep_id) in at_work
            }
            return history_rows(session, by_sweep)

    @property
    def may_be_written(self) -> bool:
        """Whether this program may write it at all."""
        return not may_only_be_read(self.location)

    def add_sample(
        self, sweep_id: int, *, stop: int, number: int, reached_mm: float, multiview: MultiView
    ) -> Sample:
        """Store one sample: first its frames, then, in one transaction, its rows.

        When this returns, the sample survives a crash of the program and of the machine. With the
        last one of the plan, in the same transaction, the sweep becomes `taken`. A frame folder
        that no row knows, of a program that was killed in between, is replaced.

        Args:
            sweep_id: the sweep.
            stop: index of the planned stop.
            number: of the sample within its stop, from 0.
            reached_mm: position of the stage, read back.
            multiview: the images.

        Raises:
            OwnedError: another program works on the sweep.
            StoreError: no such stop in the plan, this sample is stored already, or the folder of
                the sweep is gone.
        """
        doing = f"store sample {number} of stop {stop} of sweep {sweep_id}"
        lease = sweep_lease(sweep_id)
        if lease in self._held:
            self._held[lease][1].require()  # or frames would go where a disk was unmounted
        with self._reading(doing) as session:
            planned = stop_value(queries.stop_row(session, sweep_id, stop))
            sweep = queries.sweep_row(session, sweep_id)
            if queries.has_sample(session, sweep_id, (stop, number)):
                raise StoreError(
                    f"cannot {doing}: it is stored already", advice="choose another number"
                )
            root = self.frames / sweep.folder
            folder = Path(sweep.folder) / sample_folder(planned, number)
        with FrameWriter(self.frames / folder, root, self.modes) as writer:
            stored = writer.write(multiview)
            with self._writing(doing) as session:
                self._require_owned(session, lease)
                row = SampleRow(
                    sweep_id=sweep_id,
                    stop=stop,
                    sample=number,
                    reached_mm=float(reached_mm),
                    taken_at=datetime.now(UTC),
                    temperature_degc=multiview.temperature_degc,
                    folder=folder.as_posix(),
                    frames=[frame_row(place, frame) for place, frame in enumerate(stored)],
                )
                session.add(row)
                # The row goes first: where another program was quicker it is refused, and the
                # frames of that program stay as they are.
                session.flush()
                sweep = queries.sweep_row(session, sweep_id)
                if sweep.state == "taking" and queries.is_whole(session, sweep):
                    sweep.state, sweep.ended_at = "taken", row.taken_at
                writer.publish()
                return sample_value(row, self.frames)

    def samples(self, sweep_id: int) -> tuple[Sample, ...]:
        """Return the samples of a sweep in the order of its plan.

        Raises:
            StoreError: no such sweep.
        """
        with self._reading(f"read the samples of sweep {sweep_id}") as session:
            rows = queries.sample_rows(session, sweep_id)
            return tuple(sample_value(row, self.frames) for row in rows)

    def load(self, sample: Sample) -> MultiView:
        """Read the multi-view of a sample back, exactly as it was taken.

        Raises:
            StoreError: an image is missing, damaged, or another one than was stored; or the frames
                of this sample were pruned.
        """
        if sample.pruned_at is not None:
            raise StoreError(
                f"asked for the frames of sample {sample.number} of stop {sample.stop.index} of "
                f"sweep {sample.sweep_id}, they were pruned on {sample.pruned_at:%Y-%m-%d}",
                advice=f"its slopes and curve are kept: rig report {sample.sweep_id}; a backup may "
                "have the frames",
            )
        return read_frames(sample.folder, sample.frames, sample.temperature_degc)
