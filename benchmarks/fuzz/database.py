"""A database of one whole sweep, some of whose cells or bytes are changed."""

import json
import random
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

import numpy as np

from benchmarks.fuzz import mutate
from benchmarks.fuzz.geometry import known_geometry
from rig.curve import Curve
from rig.database import Store, open_store
from rig.errors import RigError
from rig.export.samples import sample_rows
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.profile.load import load_profile
from rig.stored import run_of_sweep, stored_rig
from rig.sweep.conclude import stored_conclusion
from tests.support.sweeps import SweepRecipe, stored_sweep

_TABLES = ("sweeps", "stops", "samples", "frames", "measurements", "curves", "calibrations")


class Database:
    """The file that is changed, and its valid content."""

    def __init__(self, folder: Path) -> None:
        store, result = stored_sweep(folder, SweepRecipe(samples=1))
        with store:
            self._sweep_id = result.sweep_id
            self._save_calibration(store)
        self._file = folder / "rig.sqlite"
        with closing(sqlite3.connect(self._file)) as connection:
            connection.execute("PRAGMA journal_mode = DELETE")
        self._valid = self._file.read_bytes()

    @staticmethod
    def _save_calibration(store: Store) -> None:
        profile = load_profile("sim")
        geometry = known_geometry()
        store.save_calibration(
            rig=profile.name,
            geometry=geometry_to_json(geometry),
            quality={"reprojection_rms_px": 0.03},
            profile=profile.model_dump(mode="json"),
            versions={"rig": "1"},
            devices={"camera": {"serial": "1"}},
            temperature_degc=None,
            image_size_px=(640, 400),
            active=True,
        )

    def change(self, rng: random.Random) -> None:
        """Put the valid file back, and change some of it."""
        for beside in self._file.parent.glob("rig.sqlite-*"):
            beside.unlink()
        if rng.random() < 0.25:
            self._file.write_bytes(mutate.raw(rng, self._valid))
            return
        self._file.write_bytes(self._valid)
        with closing(sqlite3.connect(self._file)) as connection, connection:
            connection.execute("PRAGMA ignore_check_constraints = ON")
            connection.execute("PRAGMA synchronous = OFF")
            for _ in range(rng.choice((1, 1, 1, 2, 3))):
                with suppress(sqlite3.IntegrityError, OverflowError, UnicodeEncodeError):
                    change = self._change_row if rng.random() < 0.15 else self._change_cell
                    change(rng, connection)

    @staticmethod
    def _change_row(rng: random.Random, connection: sqlite3.Connection) -> None:
        """Change cells together that only together mean something else."""
        told = rng.choice((
            "measurements SET plane_a_px = NULL, plane_b = NULL",
            "measurements SET centre_x_px = NULL, centre_y_px = NULL",
            "measurements SET failure_reason = 'no_board', failure_message = 'x', "
            "slope_px = NULL, sigma_px = NULL",
            "measurements SET slope_px = NULL, sigma_px = NULL",
            "sweeps SET folder = '../elsewhere'",
            "sweeps SET folder = '/etc'",
            "sweeps SET folder = ''",
            "samples SET folder = '../x'",
        ))  # fmt: skip
        with suppress(sqlite3.OperationalError):  # a column of another table
            connection.execute(f"UPDATE {told}")

    @staticmethod
    def _change_cell(rng: random.Random, connection: sqlite3.Connection) -> None:
        table = rng.choice(_TABLES)
        names = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
        name = rng.choice(names)
        rows = connection.execute(f"SELECT rowid, {name} FROM {table}").fetchall()  # noqa: S608
        number, cell = rng.choice(rows)
        connection.execute(
            f"UPDATE {table} SET {name} = ? WHERE rowid = ?",  # noqa: S608
            (_other(rng, cell), number),
        )

    def read(self) -> None:
        """Read all of it, as `history`, `report`, `fit`, `export` and `capture` do."""
        refused: RigError | None = None
        with open_store(f"sqlite:///{self._file}", absent="refused") as store:
            for look in (
                store.sweeps,
                store.calibrations,
                lambda: sample_rows(store, self._sweep_id),
                lambda: stored_rig(store, 1),
                lambda: run_of_sweep(store, store.sweep(self._sweep_id)),
                lambda: Curve.from_json(store.curve(1).curve),
                lambda: [store.load(sample) for sample in store.samples(self._sweep_id)[:1]],
                lambda: stored_conclusion(store, self._sweep_id),
            ):
                try:
                    look()
                except RigError as error:
                    refused = error
                    if "\n" in str(error):
                        raise
        if refused is not None:
            raise refused


def _other(rng: random.Random, cell: object) -> object:
    if isinstance(cell, str) and cell.startswith("{") and rng.random() < 0.8:
        return mutate.as_json(rng, json.loads(cell))
    if isinstance(cell, float) and rng.random() < 0.4:
        return rng.choice((-cell, cell * 1e6, cell * 1e-6, cell + 1.0, 0.0))
    value = rng.choice((*mutate.VALUES, b"\x00\xff", -1.0, 7, np.pi, "2026-01-01T00:00:00"))
    return json.dumps(value) if isinstance(value, list | dict) else value
