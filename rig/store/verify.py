"""`rig store verify`: every row, every file, every hash, and what belongs to nothing."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rig.database.scan_files import FACTS, read_scan
from rig.errors import StoreError
from rig.store.hashes import bad_files
from rig.store.layout import (
    ALBUM,
    MARK,
    ORPHANS,
    album_folders,
    entries,
    is_half_written,
    is_sweep_folder,
    read_album,
    rig_folders,
)

if TYPE_CHECKING:
    from rig.database import Store
    from rig.database.upkeep import SampleFiles

Kind = Literal["row", "missing", "damaged", "orphan", "half-written", "pruned", "lease", "unknown"]
"""`row`, `missing` and `damaged` are damage. `orphan`: whole pictures that no row knows.
`half-written`: what a killed program left. `pruned`: files whose removal was cut short. `lease`: of
a program that has ended. `unknown`: somebody else's file."""
DAMAGE: tuple[Kind, ...] = ("row", "missing", "damaged")
SAFE: tuple[Kind, ...] = ("orphan", "half-written", "pruned", "lease")
"""What `--repair` puts in order."""
Tell = Callable[[int, str], None]


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be."""

    kind: Kind
    place: str
    """Below the root of all frames, or the table and the number of a row."""
    found: str
    lease: str = ""
    """What has to be owned by whoever puts it right; empty for what belongs to no run."""

    def __str__(self) -> str:
        return f"{self.kind}: {self.place}: {self.found}"


@dataclass(frozen=True, slots=True)
class Inventory:
    """What a store holds, and what is wrong with it."""

    sweeps: int
    samples: int
    files: int
    """Images that were read and compared with their SHA-256."""
    pruned: int
    """Samples whose images were given up on purpose."""
    albums: int
    at_work: tuple[str, ...]
    """What other programs work on; what is unfinished there is no finding."""
    findings: tuple[Finding, ...]

    @property
    def damage(self) -> tuple[Finding, ...]:
        """What is lost or wrong."""
        return tuple(finding for finding in self.findings if finding.kind in DAMAGE)

    @property
    def litter(self) -> tuple[Finding, ...]:
        """What `--repair` would put in order."""
        return tuple(finding for finding in self.findings if finding.kind in SAFE)


def verify(store: "Store", progress: Tell = lambda *_: None) -> Inventory:
    """Look at all of a store; nothing is changed, and sweeps go on meanwhile.

    Args:
        store: open.
        progress: told how many samples have been read.

    Raises:
        StoreError: the database or the folder of all frames cannot be read at all.
    """
    samples = store.sample_files()
    findings = [_row(table, key, found) for table, key, found in _rows(store)]
    files = 0
    for number, sample in enumerate(samples, 1):
        if not sample.is_pruned:
            files += len(sample.sha256)
            findings += _sample(store.frames, sample)
        progress(number, sample.folder)
    folders = tuple(album_folders(store.frames))
    for folder in folders:
        count, found = _album(store.frames, folder)
        files += count
        findings += found
    findings += layout_findings(store)
    return Inventory(
        sweeps=len({sample.sweep_id for sample in samples} | set(store.sweep_folders().values())),
        samples=len(samples),
        files=files,
        pruned=sum(sample.is_pruned for sample in samples),
        albums=len(folders),
        at_work=tuple(store.owners()),
        findings=tuple(_still_so(store, findings)),
    )


def layout_findings(store: "Store") -> tuple[Finding, ...]:
    """Return what belongs to nothing, from names alone: no file is read."""
    known = {sample.folder: sample for sample in store.sample_files()}
    sweeps = store.sweep_folders()
    at_work = {what for what in store.owners() if not store.holds(what)}
    found = [
        *_root(store.frames, known, sweeps),
        *(Finding("lease", what, "of a program that has ended") for what in store.dead_leases()),
    ]
    return tuple(finding for finding in found if finding.lease not in at_work)


def _rows(store: "Store") -> Iterator[tuple[str, str, str]]:
    return ((row.table, row.number, row.found) for row in store.damaged_rows())


def _row(table: str, key: str, found: str) -> Finding:
    return Finding("row", f"{table} {key}".strip(), found)


def _sample(frames: Path, sample: "SampleFiles") -> Iterator[Finding]:
    lease = f"sweep {sample.sweep_id}"
    for name, wrong in bad_files(frames / sample.folder, sample.sha256).items():
        kind = "missing" if wrong == "missing" else "damaged"
        yield Finding(kind, f"{sample.folder}/{name}", wrong, lease)
    yield from _facts(frames, sample.folder, lease)


def _facts(frames: Path, place: str, lease: str) -> Iterator[Finding]:
    """Look whether the facts of a scan can be read; no row has their hash."""
    try:
        read_scan(frames / place)
    except StoreError as error:
        yield Finding("damaged", f"{place}/{FACTS}", str(error), lease)


def _album(frames: Path, folder: Path) -> tuple[int, list[Finding]]:
    album = read_album(folder)
    place, lease = (
        folder.relative_to(frames).as_posix(),
        f"album {folder.parent.name}/{folder.name}",
    )
    found = [Finding("damaged", place, line, lease) for line in album.damaged]
    for picture, sha256 in album.pictures.items():
        for name, wrong in bad_files(folder / picture, sha256).items():
            kind = "missing" if wrong == "missing" else "damaged"
            found.append(Finding(kind, f"{place}/{picture}/{name}", wrong, lease))
        found += _facts(frames, f"{place}/{picture}", lease)
    return sum(map(len, album.pictures.values())), found


def _root(
    frames: Path, known: Mapping[str, "SampleFiles"], sweeps: Mapping[str, int]
) -> Iterator[Finding]:
    rigs = set(rig_folders(frames))
    for path in entries(frames):
        if path in rigs or path.name in (ORPHANS, MARK):
            continue
        yield _stray(frames, path, "")
    for folder in (inner for rig in sorted(rigs) for inner in entries(rig)):
        place = folder.relative_to(frames).as_posix()
        if place in sweeps:
            yield from _inside_sweep(frames, folder, known, f"sweep {sweeps[place]}")
        elif is_sweep_folder(folder):
            yield Finding("orphan", place, "the folder of a sweep that no row knows")
        elif folder.name.startswith(ALBUM) and folder.is_dir():
            yield from _inside_album(frames, folder)
        else:
            yield _stray(frames, folder, "")


def _inside_sweep(
    frames: Path, folder: Path, known: Mapping[str, "SampleFiles"], lease: str
) -> Iterator[Finding]:
    for path in entries(folder):
        if not (path.is_dir() and path.name.startswith("stop_")):
            if path.name != "report.html":
                yield _stray(frames, path, lease)
            continue
        for sample in entries(path):
            yield from _sample_folder(frames, sample, known, lease)


def _sample_folder(
    frames: Path, folder: Path, known: Mapping[str, "SampleFiles"], lease: str
) -> Iterator[Finding]:
    place = folder.relative_to(frames).as_posix()
    sample = known.get(place)
    if sample is None and folder.is_dir() and folder.name.startswith("sample_"):
        yield Finding("orphan", place, "images of a sample that no row knows", lease)
    elif sample is None:
        yield _stray(frames, folder, lease)
    elif sample.is_pruned:
        yield Finding("pruned", place, "its removal was cut short", lease)
    else:
        for path in entries(folder):
            if path.name not in (*sample.sha256, FACTS):
                yield _stray(frames, path, lease)


def _inside_album(frames: Path, folder: Path) -> Iterator[Finding]:
    lease = f"album {folder.parent.name}/{folder.name}"
    album = read_album(folder)
    for path in entries(folder):
        place = path.relative_to(frames).as_posix()
        if is_half_written(path):
            yield _stray(frames, path, lease)
        elif not (path.is_dir() and path.name.startswith("picture_")):
            continue
        elif album.is_pruned:
            yield Finding("pruned", place, "its removal was cut short", lease)
        elif path.name not in album.pictures:
            yield Finding("orphan", place, "a picture that the list does not know", lease)


def _stray(frames: Path, path: Path, lease: str) -> Finding:
    place = path.relative_to(frames).as_posix()
    if is_half_written(path):
        return Finding("half-written", place, "of a program that was killed", lease)
    return Finding("unknown", place, "not made by rig, and left alone", lease)


def _still_so(store: "Store", findings: list[Finding]) -> Iterator[Finding]:
    """Look again at what others may have changed meanwhile: a sample was taken, or pruned."""
    doubtful = {"missing", "orphan", "half-written", "pruned", "lease"}
    if not any(finding.kind in doubtful for finding in findings):
        yield from findings
        return
    pruned = {sample.folder for sample in store.sample_places() if sample.is_pruned}
    again = set(layout_findings(store))
    for finding in findings:
        if finding.kind == "missing":
            if finding.place.rpartition("/")[0] not in pruned:
                yield finding
        elif finding.kind not in doubtful or finding in again:
            yield finding
