"""Cells that hold something else than their column says: told, whatever reads them."""

import hashlib
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.database import Store, open_store
from rig.errors import StoreError
from rig.measurement import Measurement
from tests.support.multiviews import noisy_multiview
from tests.support.stores import new_calibration, new_sweep, sqlite_url


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path)) as opened:
        new_calibration(opened)
        sweep_id = new_sweep(opened)
        sample = opened.add_sample(
            sweep_id, stop=0, number=0, reached_mm=1.0, multiview=noisy_multiview(0)
        )
        opened.save_measurements(sweep_id, {sample.key: Measurement(slope_px=1.5)})
        opened.save_curve(sweep_id, curve={}, holdout={}, versions={})
        yield opened


def put(tmp_path: Path, statement: str, *values: object) -> None:
    with closing(sqlite3.connect(tmp_path / "rig.sqlite")) as connection, connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        assert connection.execute(statement, values).rowcount > 0


READ: dict[str, Callable[[Store], object]] = {
    "sweeps": lambda store: store.sweep(1),
    "stops": lambda store: store.sweep(1),
    "samples": lambda store: store.samples(1),
    "frames": lambda store: store.samples(1),
    "measurements": lambda store: store.measurements(1),
    "curves": lambda store: store.curve(1),
    "calibrations": lambda store: store.calibrations(),
}


@pytest.mark.parametrize(
    ("table", "column", "cell", "told"),
    [
        ("sweeps", "folder", b"\x00", "sweeps.folder of row 1 is b'"),
        ("sweeps", "samples_per_stop", "two", "sweeps.samples_per_stop of row 1 is 'two'"),
        ("sweeps", "samples_per_stop", 1.5, "sweeps.samples_per_stop of row 1 is 1.5"),
        ("sweeps", "state", "sleeping", "sweeps.state of row 1 is 'sleeping'"),
        ("sweeps", "profile", '{"name": ', "a JSON object belongs where '\\{\"name\": ' is"),
        ("sweeps", "profile", "[" * 99_999, "a JSON object belongs where '\\[{36}... is"),
        ("sweeps", "profile", "[1]", "a JSON object belongs where '\\[1\\]' is"),
        ("sweeps", "devices", 7, "a JSON object belongs where '7' is"),
        ("sweeps", "started_at", "today", "a moment belongs where 'today' is"),
        ("sweeps", "started_at", "2026-01-01", "a moment with its zone belongs where '2026"),
        ("stops", "role", "judge", "stops.role of row 1, 0 is 'judge'"),
        ("stops", "direction", "up", "stops.direction of row 1, 0 is 'up'"),
        ("stops", "distance_mm", "far", "stops.distance_mm of row 1, 0 is 'far'"),
        ("samples", "reached_mm", "far", "samples.reached_mm of row 1 is 'far'"),
        ("frames", "sequence", "x" * 50, "frames.sequence of row 1, 0 is 'x{36}\\.\\.\\."),
        ("frames", "bits", b"8", "frames.bits of row 1, 0 is b'8'"),
        ("measurements", "slope_px", "steep", "measurements.slope_px of row 1 is 'steep'"),
        ("measurements", "sigma_px", float("inf"), "the measurement of row 1: sigma_px is inf"),
        ("curves", "holdout", "null", "a JSON object belongs where 'null' is"),
        ("calibrations", "width_px", "wide", "calibrations.width_px of row 1 is 'wide'"),
    ],
)
def test_a_cell_of_another_kind_is_named(
    store: Store, tmp_path: Path, table: str, column: str, cell: object, told: str
):
    put(tmp_path, f"UPDATE {table} SET {column} = ?", cell)  # noqa: S608
    with pytest.raises(StoreError, match=told) as caught:
        READ[table](store)
    assert "the database is damaged" in caught.value.found
    assert caught.value.advice in ("bring it back from a copy", "run rig fit on its sweep")


def test_an_empty_cell_is_told_where_there_must_be_one(store: Store, tmp_path: Path):
    with closing(sqlite3.connect(tmp_path / "rig.sqlite")) as connection, connection:
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute(
            "UPDATE sqlite_schema SET sql = replace(sql, 'reached_mm DOUBLE NOT NULL', "
            "'reached_mm DOUBLE') WHERE name = 'samples'"
        )
    put(tmp_path, "UPDATE samples SET reached_mm = NULL")
    with pytest.raises(StoreError, match=r"samples\.reached_mm of row 1 is empty"):
        store.samples(1)


def test_whole_numbers_are_lengths_too(store: Store, tmp_path: Path):
    put(tmp_path, "UPDATE samples SET reached_mm = 3, temperature_degc = NULL")
    (sample,) = store.samples(1)
    assert (sample.reached_mm, sample.temperature_degc) == (3.0, None)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"no picture", "left.png: the image is no image of a known format"),
        (
            cv2.imencode(".png", np.zeros((3, 4, 3), np.uint8))[1].tobytes(),
            r"holds \(3, 4, 3\) of uint8, stored images are grey",
        ),
        (
            cv2.imencode(".tiff", np.zeros((3, 4), np.float32))[1].tobytes(),
            r"holds \(3, 4\) of float32, stored images are grey",
        ),
    ],
)
def test_an_image_of_another_kind_is_refused_even_with_its_hash(
    store: Store, tmp_path: Path, content: bytes, told: str
):
    (sample,) = store.samples(1)
    view = sample.frames[0].view
    (sample.folder / f"{view}.png").write_bytes(content)
    put(tmp_path, "UPDATE frames SET sha256 = ?", hashlib.sha256(content).hexdigest())
    (sample,) = store.samples(1)
    with pytest.raises(StoreError, match=told.replace("left", view)):
        store.load(sample)
