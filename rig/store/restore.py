"""`rig store restore`: a backup, in an empty place."""

import json
from dataclasses import dataclass
from pathlib import Path

from rig.database.location import Location
from rig.database.store import store_at
from rig.disk import disk_explained
from rig.errors import StoreError
from rig.files import make_folder, put_on_disk, sync_folder
from rig.folder_lock import FolderLock
from rig.store.copy_frames import Copied, FrameCopy, Progress
from rig.store.hashes import digest
from rig.store.layout import MARK
from rig.store.manifest import DATABASE, FILE, FRAMES, Manifest, read_manifest
from rig.store.place import put_rows, require_empty, scratch


@dataclass(frozen=True, slots=True)
class Restored:
    """What came back."""

    database: str
    frames: Path
    manifest: Manifest
    copied: Copied


def restore(folder: Path, location: Location, progress: Progress = lambda *_: None) -> Restored:
    """Bring a backup back into an empty place; the database comes last.

    Killed at any moment, the same command goes on, and until its end no database is there.

    Args:
        folder: of the backup.
        location: where to; neither rows nor frames are there.
        progress: told how many folders of images are done.

    Raises:
        OwnedError: another program fills the same place.
        StoreError: the backup is unfinished or damaged, the place is not empty, or it cannot be
            written.
    """
    manifest, content = _whole_backup(folder)
    mark = json.dumps({"restores": str(folder.absolute()), "made_at": manifest.made_at})
    require_empty(location, mark)
    with disk_explained("restore a backup", location.frames):
        make_folder(location.frames, location.modes.folder)
    with FolderLock(location.frames, mode=location.modes.file):
        with disk_explained("restore a backup", location.frames):
            put_on_disk(location.frames / MARK, mark.encode(), location.modes.file)
        with scratch(location) as rows:
            put_on_disk(rows, content, location.modes.file)
            copy = FrameCopy(folder / FRAMES, location.frames, location.modes, progress)
            with store_at(rows, folder / FRAMES, location.modes) as stored:  # upgrades an old one
                copy.samples(stored.sample_files())
            copy.albums()
            put_rows(rows, location)
        with disk_explained("restore a backup", location.frames):
            (location.frames / MARK).unlink()
            sync_folder(location.frames)
    return Restored(str(location), location.frames, manifest, copy.copied)


def _whole_backup(folder: Path) -> tuple[Manifest, bytes]:
    """Return what a backup holds, and its database, after a look at both.

    Raises:
        StoreError: there is none, it is unfinished, or its database is damaged.
    """
    manifest = read_manifest(folder)
    if manifest is None or not manifest.is_whole:
        found = "none" if manifest is None else "one that is unfinished"
        raise StoreError(
            f"{folder}: asked to restore a backup, found {found}",
            advice=f"name the folder that {FILE} lies in, of a backup that has ended",
        )
    file = folder / DATABASE
    with disk_explained("read the backup", file):
        content = file.read_bytes()
    if digest(content) not in manifest.sha256:
        raise StoreError(
            f"{file}: is damaged, or was changed after the backup ({len(content)} bytes, wrong "
            "SHA-256)",
            advice="take another backup",
        )
    return manifest, content
