"""`rig store verify`: what is found, and what `--repair` does and does not touch."""

import shutil
import sqlite3
from collections import Counter
from contextlib import closing
from pathlib import Path

import pytest

from rig.calibrate.album import Album
from rig.calibrate.pictures import Picture
from rig.database import Store, open_store
from rig.database.tables import LeaseRow
from rig.errors import OwnedError
from rig.profile.load import load_profile
from rig.store.layout import ORPHANS
from rig.store.repair import repair
from rig.store.verify import Finding, verify
from tests.support.kept_stores import CONCLUDED, FILES, SAMPLES, TAKEN, kept_store, sample_place
from tests.support.multiviews import noisy_multiview
from tests.support.stores import sqlite_url


def kinds(store: Store) -> Counter[str]:
    return Counter(finding.kind for finding in verify(store).findings)


def rewrite(folder: Path, *statements: str) -> None:
    """Change rows behind the back of the program, as a failing disk or a person would."""
    with closing(sqlite3.connect(folder / "rig.sqlite")) as connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        for statement in statements:
            connection.execute(statement)
        connection.commit()


def test_a_store_in_order_has_no_findings(tmp_path: Path):
    with kept_store(tmp_path) as store:
        told: list[int] = []
        found = verify(store, lambda count, _: told.append(count))
    assert found.findings == found.damage == found.litter == ()
    assert (found.sweeps, found.samples, found.files) == (2, 2 * SAMPLES, 2 * FILES)
    assert (found.pruned, found.albums, found.at_work) == (0, 0, ())
    assert told == list(range(1, 2 * SAMPLES + 1))


def test_damaged_and_missing_images_are_named(tmp_path: Path):
    with kept_store(tmp_path) as store:
        first, second = sample_place(store, TAKEN), sample_place(store, TAKEN, 1)
        content = bytearray((first / "left.png").read_bytes())
        content[-1] ^= 1
        (first / "left.png").write_bytes(content)
        (first / "top.png").unlink()
        shutil.rmtree(second)
        found = verify(store)
        places = {(f.kind, f.place, f.lease) for f in found.damage}
        where = [path.relative_to(store.frames).as_posix() for path in (first, second)]
        assert places == {
            ("damaged", f"{where[0]}/left.png", "sweep 2"),
            ("missing", f"{where[0]}/top.png", "sweep 2"),
            *(("missing", f"{where[1]}/{v}.png", "sweep 2") for v in ("centre", "left", "top")),
        }
        assert repair(store, found.findings).done == ()
        assert verify(store).findings == found.findings


@pytest.mark.parametrize(
    ("statement", "finding"),
    [
        ("UPDATE sweeps SET profile = '[1]' WHERE id = 1", "sweeps 1: profile: [1], wanted is a "
         "JSON object"),
        ("UPDATE sweeps SET profile = '{' WHERE id = 1", "sweeps 1: profile: {, wanted is a JSON "
         "object"),
        ("UPDATE sweeps SET started_at = '2026-01-02' WHERE id = 2", "sweeps 2: started_at: "
         "2026-01-02, wanted is a time with its zone"),
        ("UPDATE sweeps SET state = 'done' WHERE id = 2", "sweeps 2: state: done, wanted is one of "
         "taking, taken, concluded, failed"),
        ("UPDATE sweeps SET folder = '../x' WHERE id = 9", ""),
        ("UPDATE samples SET reached_mm = 'far' WHERE id = 4", "samples 4: reached_mm: far, wanted "
         "is a finite number"),
        ("UPDATE samples SET stop = 7 WHERE id = 1", "samples 1: refers to stops 1 7, where "
         "nothing is"),
        ("UPDATE curves SET active = 5", "curves 1: active: 5, wanted is true or false"),
        ("UPDATE curves SET curve = CAST(x'7bff7d' AS TEXT)", "curves 1: curve: '{\\udcff}' is no "
         "text"),
        ("UPDATE frames SET sequence = 1.5 WHERE sample_id = 2 AND place = 1", "frames 2 1: "
         "sequence: 1.5, wanted is a whole number"),
    ],
)  # fmt: skip
def test_every_damaged_row_is_named_and_hides_no_other(
    tmp_path: Path, statement: str, finding: str
):
    kept_store(tmp_path).close()
    rewrite(tmp_path, statement)
    with open_store(sqlite_url(tmp_path)) as store:
        found = [str(f) for f in verify(store).findings if f.kind == "row"]
        assert found == ([f"row: {finding}"] if finding else [])
        # The images are looked at all the same, but those of a row that names no place.
        assert verify(store).files >= 2 * FILES - 3


def test_a_folder_outside_the_frames_is_damage(tmp_path: Path):
    kept_store(tmp_path).close()
    rewrite(tmp_path, "UPDATE samples SET folder = '../../etc' WHERE id = 1")
    with open_store(sqlite_url(tmp_path)) as store:
        (row,) = verify(store).damage
    assert row.place == "samples 1"
    assert "'../../etc', which is not below" in row.found


def litter(store: Store) -> None:
    """Leave behind what killed programs leave."""
    sample = sample_place(store, TAKEN)
    (sample.parent / ".sample_07.0a.tmp").mkdir()
    (sample.parent / "sample_08").mkdir()
    (sample.parent / "sample_08" / "left.png").write_bytes(b"whole")
    (sample.parents[1] / ".report.html.4711.tmp").write_bytes(b"half")
    (store.frames / "bench" / "77_20260101-000000").mkdir()
    other = store.frames / "bench" / "78_20260101-000000" / "stop_000"
    other.mkdir(parents=True)
    (other / "x.png").write_bytes(b"kept")
    (store.frames / ".check-99").write_bytes(b"rig")
    (store.frames / "notes.txt").write_text("mine")


def test_repair_removes_halves_and_puts_whole_pictures_aside(tmp_path: Path):
    with kept_store(tmp_path) as store:
        litter(store)
        found = verify(store)
        assert Counter(f.kind for f in found.findings) == {
            "half-written": 3, "orphan": 3, "unknown": 1,
        }  # fmt: skip
        assert found.damage == ()
        done = repair(store, found.findings)
        assert (set(done.done), done.refused) == (set(found.litter), ())
        assert done.aside is not None
        assert done.aside.parent == store.frames / ORPHANS
        kept = {path.relative_to(done.aside).as_posix() for path in done.aside.rglob("*.png")}
        sample = sample_place(store, TAKEN).parent.relative_to(store.frames)
        assert kept == {
            f"{sample.as_posix()}/sample_08/left.png",
            "bench/78_20260101-000000/stop_000/x.png",
        }
        assert [f.place for f in verify(store).findings] == ["notes.txt"]
        assert store.owners() == {}


def test_repair_leaves_alone_what_a_living_program_owns(tmp_path: Path):
    with kept_store(tmp_path) as store, open_store(sqlite_url(tmp_path)) as other:
        litter(store)
        findings = verify(store).findings
        with other.owned_sweep(TAKEN, "asked"):
            assert not any(f.lease == "sweep 2" for f in verify(store).findings)
            assert verify(store).at_work == ("sweep 2",)
            done = repair(store, findings)
        (line,) = done.refused
        assert line.startswith("asked to repair sweep 2, it belongs to process")
        assert all(f.lease == "" for f in done.done)
        assert kinds(store) == {"half-written": 2, "orphan": 1, "unknown": 1}


@pytest.mark.slow
def test_two_do_not_repair_at_once(tmp_path: Path):
    with kept_store(tmp_path) as store, open_store(sqlite_url(tmp_path)) as other:
        litter(store)
        findings = verify(store).findings
        with (
            other.owned("frames", other.frames, "asked"),
            pytest.raises(OwnedError, match="asked to repair the store, it belongs to process"),
        ):
            repair(store, findings)
        assert kinds(store)["orphan"] == 3


def test_leases_of_ended_programs_are_cleared(tmp_path: Path):
    with kept_store(tmp_path) as store:
        with store._writing("test") as session:
            session.add(
                LeaseRow(
                    what="sweep 2", token="t" * 32,
                    host="x", pid=1, process="other boot 1",
                    since=store.sweep(1).started_at, heartbeat=store.sweep(1).started_at,
                )
            )  # fmt: skip
            session.flush()
            # Not heard of for longer than any owner may be silent.
            session.execute(
                LeaseRow.__table__.update().values(  # pyright: ignore
                    heartbeat=store.sweep(1).started_at.replace(year=2001)
                )
            )
        found = verify(store).findings
        assert found == (Finding("lease", "sweep 2", "of a program that has ended"),)
        assert repair(store, found).done == found
        assert verify(store).findings == ()


@pytest.mark.slow
def test_albums_are_verified_by_their_lists(tmp_path: Path):
    with kept_store(tmp_path) as store:
        album = Album.new(store.frames, load_profile("sim"))
        for number in range(2):
            album.keep(Picture(number, noisy_multiview(number)))
        assert (verify(store).findings, verify(store).albums) == ((), 1)
        assert verify(store).files == 2 * FILES + 6
        (album.folder / "picture_000" / "left.png").unlink()
        shutil.copytree(album.folder / "picture_001", album.folder / "picture_002")
        (album.folder / ".picture_003.a.tmp").mkdir()
        with (album.folder / "pictures.jsonl").open("a") as file:
            file.write("{}\n")
            file.write('{"cut')
        found = Counter(f.kind for f in verify(store).findings)
        assert found == {"missing": 1, "orphan": 1, "half-written": 1, "damaged": 1}
        repair(store, verify(store).findings)
        assert kinds(store) == {"missing": 1, "damaged": 1}


def test_what_was_pruned_is_no_damage_and_its_rest_goes(tmp_path: Path):
    with kept_store(tmp_path) as store:
        with store.owned_sweep(CONCLUDED, "asked"):
            assert store.mark_pruned(CONCLUDED) == SAMPLES
            assert store.mark_pruned(CONCLUDED) == 0
        found = verify(store)
        assert Counter(f.kind for f in found.findings) == {"pruned": SAMPLES}
        assert (found.damage, found.pruned, found.files) == ((), SAMPLES, FILES)
        repair(store, found.findings)
        assert verify(store).findings == ()
