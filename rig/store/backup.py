"""`rig store backup`: a whole store in a folder, taken while sweeps go on.

First a copy of the rows as they are at one instant, then the frames that these rows know: frames
are there before their rows are, and never change. What is taken meanwhile is in the next backup.
"""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.database.leases import FRAMES as FRAMES_LEASE
from rig.database.store import store_at
from rig.disk import disk_explained
from rig.errors import StoreError
from rig.files import make_folder, sync_file, sync_folder
from rig.folder_lock import FolderLock
from rig.store.copy_frames import FrameCopy, Progress
from rig.store.hashes import digest
from rig.store.layout import entries
from rig.store.manifest import DATABASE, FRAMES, Manifest, read_manifest, write_manifest
from rig.store.place import require_outside

if TYPE_CHECKING:
    from rig.database import Store

_VERSION = 1
_PART = f".{DATABASE}.tmp"


def back_up(store: "Store", folder: Path, progress: Progress = lambda *_: None) -> Manifest:
    """Copy a store into a folder; one that holds an older backup of it is brought up to date.

    Killed at any moment, the same command goes on; an older backup in the folder stays whole.

    Args:
        store: open.
        folder: new, empty, or of an older backup of this store.
        progress: told how many folders of images are done.

    Returns:
        What is in the backup; `bad` names what was missing or damaged in the store.

    Raises:
        OwnedError: another program copies or removes frames, or writes into this folder.
        StoreError: the folder holds something else, or cannot be written.
    """
    require_outside(folder, store.frames, "make a backup")
    before = _require_ours(store, folder)
    with disk_explained("make a backup", folder):
        make_folder(folder / FRAMES, store.modes.folder)
    with FolderLock(folder, mode=store.modes.file), _frames_stay(store):
        with disk_explained("make a backup", folder):
            if before is None:
                before = Manifest(_VERSION, store.database, _now(), (), 0, 0, 0, (), is_whole=False)
                write_manifest(folder, before, store.modes.file)
            _clear(folder)
        part = folder / _PART
        store.write_copy(part)
        with store_at(part, folder / FRAMES, store.modes) as copy:
            samples = copy.sample_files()
            sweeps = len(copy.sweep_folders())
        _clear(folder, keep=_PART)
        frames = FrameCopy(store.frames, folder / FRAMES, store.modes, progress)
        frames.samples(samples)
        frames.albums()
        with disk_explained("make a backup", folder):
            return _put_in_place(store, folder, before, sweeps, len(samples), frames)


def _put_in_place(
    store: "Store", folder: Path, before: Manifest, sweeps: int, samples: int, frames: FrameCopy
) -> Manifest:
    part = folder / _PART
    part.chmod(store.modes.file)
    sync_file(part)
    sha256 = digest(part.read_bytes())
    copied = frames.copied
    whole = Manifest(
        _VERSION,
        store.database,
        _now(),
        (sha256,),
        sweeps,
        samples,
        copied.files,
        tuple(copied.bad),
    )
    # Whichever of the two files is there if this is cut short, the manifest knows it.
    write_manifest(folder, replace(whole, sha256=(sha256, *before.sha256[:1])), store.modes.file)
    part.replace(folder / DATABASE)
    sync_folder(folder)
    write_manifest(folder, whole, store.modes.file)
    return whole


@contextmanager
def _frames_stay(store: "Store") -> Generator[None]:
    """Let nobody remove frames while they are copied; a store that may only be read loses none."""
    if not store.may_be_written:
        yield
        return
    with disk_explained("make a backup", store.frames):
        make_folder(store.frames, store.modes.folder)
    with store.owned(FRAMES_LEASE, store.frames, "asked to make a backup"):
        yield


def _require_ours(store: "Store", folder: Path) -> Manifest | None:
    manifest = read_manifest(folder)
    if manifest is not None:
        if manifest.source == store.database:
            return manifest
        raise StoreError(
            f"{folder}: asked for a backup of {store.database}, found one of {manifest.source}",
            advice="choose another folder",
        )
    found = [path.name for path in entries(folder) if path.name != FRAMES or entries(path)]
    if found or folder.is_file():
        raise StoreError(
            f"{folder}: asked to make a backup, found {', '.join(found[:3]) or 'a file'} there",
            advice="choose a new or an empty folder",
        )
    return None


def _clear(folder: Path, keep: str = "") -> None:
    for path in folder.glob(f"{_PART}*"):
        if path.name != keep:
            path.unlink()


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
