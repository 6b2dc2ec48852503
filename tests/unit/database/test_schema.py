"""The tables: made by migrations, the same as declared, and never touched when they are newer."""

import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine, inspect
from sqlalchemy.dialects import postgresql
from sqlalchemy.schema import CreateTable

from rig.database import open_store
from rig.database.location import locate
from rig.database.schema import MIGRATIONS, REVISIONS, open_engine
from rig.database.tables import Row
from rig.errors import StoreError
from tests.support.stores import new_calibration, new_sweep, sqlite_url


def tables(url: str) -> dict[str, dict[str, object]]:
    """Return what every table of rig is made of: columns, keys, references, indexes, checks."""
    engine = create_engine(url)
    found = inspect(engine)
    described: dict[str, dict[str, object]] = {
        name: {
            "columns": {
                c["name"]: (str(c["type"]), c["nullable"]) for c in found.get_columns(name)
            },
            "key": found.get_pk_constraint(name),
            # Without their names: SQLite keeps none for a column that was added later.
            "references": sorted(
                (key["constrained_columns"], key["referred_table"], key["referred_columns"])
                for key in found.get_foreign_keys(name)
            ),
            "unique": found.get_unique_constraints(name),
            "indexes": found.get_indexes(name),
            "checks": sorted(map(str, found.get_check_constraints(name))),
        }
        for name in found.get_table_names()
        if name != "alembic_version"
    }
    engine.dispose()
    return described


def old_database(file: Path) -> None:
    """Make a database of the first schema with a sweep, its slope and its curve in it."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.set_main_option("path_separator", "os")
    engine = create_engine(f"sqlite:///{file}")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "rig_0001")
        for statement in (
            "INSERT INTO sweeps VALUES (7, 'bench', '{\"name\":\"bench\"}', '{}', '{}', 1, "
            "'2026-01-02T03:04:05.000000+00:00', NULL, 'interrupted', 'bench/7', 'old')",
            "INSERT INTO stops VALUES (7, 0, 400.5, 'fit', 'forward')",
            "INSERT INTO samples VALUES (3, 7, 0, 0, 400.25, "
            "'2026-01-02T03:04:06.000000+00:00', 31.5, 'bench/7/0')",
            "INSERT INTO frames VALUES (3, 0, 'centre', 1.25, 9, NULL, 'ab')",
            "INSERT INTO measurements (sample_id, slope_px, details) VALUES (3, 1.5, '{}')",
            "INSERT INTO curves VALUES (2, 'bench', 7, '2026-01-02T03:04:07.000000+00:00', "
            "'{\"model\":\"x\"}', '{\"rms_pct\":0.5}', '{}', 1)",
        ):
            connection.exec_driver_sql(statement)
    engine.dispose()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_migrations_make_exactly_the_declared_tables(tmp_path: Path) -> None:
    open_store(sqlite_url(tmp_path)).close()
    declared = tmp_path / "declared.sqlite"
    engine = create_engine(f"sqlite:///{declared}")
    Row.metadata.create_all(engine)
    engine.dispose()
    made = tables(sqlite_url(tmp_path))
    assert made == tables(f"sqlite:///{declared}")
    assert {"sweeps", "stops", "samples", "frames", "measurements", "curves"} <= set(made)


def test_an_old_database_is_upgraded_with_everything_in_it(tmp_path: Path) -> None:
    old_database(tmp_path / "rig.sqlite")
    with open_store(sqlite_url(tmp_path)) as store:
        sweep = store.sweep(7)
        assert (sweep.note, sweep.state, sweep.calibration_id) == ("old", "concluded", None)
        (sample,) = store.samples(7)
        assert (sample.reached_mm, sample.frames[0].sequence) == (400.25, 9)
        assert (sample.frames[0].bits, sample.frames[0].uncertainty_s) == (None, 0.0)
        assert store.measurements(7)[0, 0].slope_px == 1.5
        curve = store.active_curve("bench")
        assert (curve.id, curve.curve, curve.calibration_id) == (2, {"model": "x"}, None)
        assert store.calibrations() == ()
        # And the upgraded tables take what only the new ones know.
        calibration_id = new_calibration(store)
        store.replace_measurements(7, {}, calibration_id=calibration_id)
        newer = store.save_curve(7, curve={}, holdout={}, versions={}, row_errors={"rms_px": [1.5]})
        assert store.curve(newer).calibration_id == calibration_id
        assert (curve.row_errors, store.curve(newer).row_errors) == (None, {"rms_px": [1.5]})
    assert tables(sqlite_url(tmp_path)).keys() == Row.metadata.tables.keys()


def test_old_states_become_what_is_still_to_do(tmp_path: Path) -> None:
    old_database(tmp_path / "rig.sqlite")
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    # number, state, whether its one sample is there, whether it has a curve
    for number, state, is_whole, has_curve in (
        (8, "finished", True, True),
        (9, "finished", True, False),
        (10, "finished", False, True),
        (11, "running", True, False),
        (12, "running", False, False),
        (13, "interrupted", False, True),
        (14, "failed", False, False),
        (15, "failed", True, False),
        (16, "failed", True, True),
    ):
        moment = "2026-01-02T03:04:05.000000+00:00"
        connection.execute(
            "INSERT INTO sweeps VALUES (?, 'bench', '{}', '{}', '{}', 1, ?, NULL, ?, 'f', '')",
            (number, moment, state),
        )
        connection.execute("INSERT INTO stops VALUES (?, 0, 400.5, 'fit', 'forward')", (number,))
        sample = 0 if is_whole else 1  # a second sample of a stop is not the first
        connection.execute(
            "INSERT INTO samples VALUES (?, ?, 0, ?, 400.25, ?, NULL, 'f')",
            (number, number, sample, moment),
        )
        if has_curve:
            connection.execute(
                "INSERT INTO curves VALUES (?, 'bench', ?, ?, '{}', '{}', '{}', 1)",
                (number, number, moment),
            )
    connection.commit()
    connection.close()
    with open_store(sqlite_url(tmp_path)) as store:
        states = {row.id: row.state for row in store.sweeps()}
        assert [len(store.samples(number)) for number in states] == [1] * 10
    assert states == {
        7: "concluded",
        8: "concluded",
        9: "taken",
        10: "concluded",
        11: "taken",
        12: "taking",
        13: "taking",
        14: "failed",
        15: "failed",
        16: "concluded",
    }


def test_an_old_database_with_lost_rows_is_left_as_it_is(tmp_path: Path) -> None:
    old_database(tmp_path / "rig.sqlite")
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    connection.execute("DELETE FROM sweeps")
    connection.commit()
    connection.close()
    with pytest.raises(StoreError, match="a row of stops refers to sweeps, where nothing is"):
        open_store(sqlite_url(tmp_path))
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    assert connection.execute("SELECT version_num FROM alembic_version").fetchone() == ("rig_0001",)
    connection.close()


def test_the_program_knows_every_migration() -> None:
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.set_main_option("path_separator", "os")
    script = ScriptDirectory.from_config(config)
    newest_first = [revision.revision for revision in script.walk_revisions()]
    assert tuple(reversed(newest_first)) == REVISIONS


def test_other_databases_keep_every_digit_too() -> None:
    for table in Row.metadata.sorted_tables:
        made = str(CreateTable(table).compile(dialect=postgresql.dialect()))
        assert " REAL" not in made
        assert " FLOAT" not in made
    samples = str(CreateTable(Row.metadata.tables["samples"]).compile(dialect=postgresql.dialect()))
    assert "reached_mm DOUBLE PRECISION NOT NULL" in samples


def test_sqlite_is_told_to_be_careful(tmp_path: Path) -> None:
    engine = open_engine(locate(sqlite_url(tmp_path), {}))
    with engine.connect() as connection:
        settings = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("journal_mode", "foreign_keys", "synchronous", "busy_timeout")
        }
    engine.dispose()
    full = 2
    assert settings == {
        "journal_mode": "wal",
        "foreign_keys": 1,
        "synchronous": full,
        "busy_timeout": 5000,
    }


def test_the_reference_names_every_column() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "database.md").read_text()
    rows = {line.split("`")[1]: line for line in page.splitlines() if line.startswith("| `")}
    for table in Row.metadata.sorted_tables:
        missing = [name for name in table.columns.keys() if f"`{name}`" not in rows[table.name]]  # noqa: SIM118
        assert not missing, table.name


def test_a_folder_with_odd_signs_is_no_obstacle(tmp_path: Path) -> None:
    folder = tmp_path / "100 % größer" / "new"
    with open_store(sqlite_url(folder)) as store:
        assert new_sweep(store) == 1


@pytest.mark.slow
def test_a_current_database_opens_without_the_migration_tool(tmp_path: Path) -> None:
    open_store(sqlite_url(tmp_path)).close()
    program = (
        "import sys; from rig.database import open_store; "
        f"open_store({sqlite_url(tmp_path)!r}).close(); assert 'alembic' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_several_programs_may_make_the_database_at_once(tmp_path: Path) -> None:
    count = 3
    start = threading.Barrier(count)
    failed: list[BaseException] = []

    def make() -> None:
        start.wait()
        try:
            with open_store(sqlite_url(tmp_path)) as store:
                new_sweep(store)
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=make) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    with open_store(sqlite_url(tmp_path)) as store:
        assert [row.id for row in store.sweeps()] == [1, 2, 3]


def test_a_newer_database_is_left_as_it_is(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        new_sweep(store)
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    connection.execute("UPDATE alembic_version SET version_num = 'rig_0099'")
    connection.execute("ALTER TABLE sweeps ADD COLUMN humidity_pct REAL")
    connection.commit()
    connection.close()
    before = contents(tmp_path)
    with pytest.raises(
        StoreError, match=r"schema rig_0099, this rig knows up to rig_0007; upgrade rig"
    ) as refused:
        open_store(sqlite_url(tmp_path))
    assert "\n" not in str(refused.value)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("versioned", [False, True])
def test_a_database_of_another_program_is_left_as_it_is(tmp_path: Path, versioned: bool) -> None:
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    connection.execute("CREATE TABLE recipes (id INTEGER)")
    if versioned:
        connection.execute("CREATE TABLE alembic_version (version_num TEXT)")
        connection.execute("INSERT INTO alembic_version VALUES ('0001')")
    connection.commit()
    connection.close()
    before = contents(tmp_path)
    with pytest.raises(StoreError, match=r"recipes.* of another program; choose another"):
        open_store(sqlite_url(tmp_path))
    assert contents(tmp_path) == before


def test_a_file_that_is_no_database_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "rig.sqlite").write_bytes(b"my thesis, the only copy\n" * 400)
    before = contents(tmp_path)
    with pytest.raises(StoreError, match=r"rig\.sqlite: .*the file is no SQLite database"):
        open_store(sqlite_url(tmp_path))
    assert contents(tmp_path) == before


def test_a_folder_is_no_database(tmp_path: Path) -> None:
    (tmp_path / "rig.sqlite").mkdir()
    with pytest.raises(StoreError, match="cannot open the database: it cannot be opened"):
        open_store(sqlite_url(tmp_path))


def test_unknown_kinds_of_database_are_named() -> None:
    with pytest.raises(StoreError, match="no such kind of database: abacus"):
        open_store("abacus://me:geheim@bench/rig")
    with pytest.raises(StoreError, match="driver cx_Oracle is not installed") as refused:
        open_store("oracle+cx_oracle://me:geheim@bench/rig")
    assert "geheim" not in str(refused.value)
