"""`rig store move`: the same store at another place. Nobody works on any of it meanwhile."""

import json
import shutil
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.database.leases import STORE
from rig.database.location import Location
from rig.database.upkeep import SampleFiles
from rig.disk import disk_explained
from rig.files import make_folder, put_on_disk, sync_folder
from rig.folder_lock import FolderLock
from rig.store.copy_frames import Copied, FrameCopy, Progress
from rig.store.layout import MARK, album_folders, read_album
from rig.store.place import (
    put_rows,
    remove_database,
    require_empty_frames,
    require_no_rows,
    require_outside,
    scratch,
)

if TYPE_CHECKING:
    from rig.database import Store


@dataclass(frozen=True, slots=True)
class Moved:
    """Where a store is now."""

    database: str
    frames: Path
    copied: Copied
    left: tuple[Path, ...]
    """What stayed behind because no row knows it."""


def move(store: "Store", folder: Path, progress: Progress = lambda *_: None) -> Moved:
    """Move a store into a folder: the file of its database, and its frames as `frames/`.

    What is on a server stays there; then only the frames move, and `RIG_FRAMES` has to say where.
    All is copied and compared before anything is removed; killed before that, the same command goes
    on.

    Args:
        store: open.
        folder: new or empty.
        progress: told how many folders of images are done.

    Raises:
        OwnedError: a program works on a part of the store.
        StoreError: the folder is not empty, or cannot be written.
    """
    location = _place_in(store.location, folder)
    mark = json.dumps({"moves": store.database, "to": str(folder.absolute())})
    if location.file is not None:
        require_no_rows(location)
    require_empty_frames(location, mark)
    require_outside(folder, store.frames, "move")
    for path in (store.frames, location.frames):
        with disk_explained("move a store", path):
            make_folder(path, store.modes.folder)
    with (
        store.owned(STORE, store.frames, "asked to move the store"),
        FolderLock(location.frames, mode=store.modes.file),
    ):
        with disk_explained("move a store", location.frames):
            put_on_disk(location.frames / MARK, mark.encode(), store.modes.file)
        samples = store.sample_files()
        copy = FrameCopy(store.frames, location.frames, store.modes, progress, keeps_damaged=True)
        copy.samples(samples)
        copy.albums()
        if location.file is not None:
            _move_rows(store, location)
        with disk_explained("move a store", location.frames):
            (location.frames / MARK).unlink()
            sync_folder(location.frames)
        _remove_frames(store.frames, samples)
    left = tuple(path for path in sorted(store.frames.rglob("*")) if path.is_file())
    with suppress(OSError):
        store.frames.rmdir()
    return Moved(str(location), location.frames, copy.copied, left)


def _place_in(here: Location, folder: Path) -> Location:
    there = folder.absolute()
    url = here.url if here.file is None else here.url.set(database=str(there / here.file.name))
    return replace(here, url=url, frames=there / "frames")


def _move_rows(store: "Store", location: Location) -> None:
    file = store.location.file
    if file is None:
        raise AssertionError  # a server's rows are not moved
    with scratch(location) as rows, store.nothing_begins():
        store.write_copy(rows)
        put_rows(rows, location)
        with disk_explained("move a store", file):
            remove_database(file)


def _remove_frames(frames: Path, samples: Iterable[SampleFiles]) -> None:
    """Remove what was copied, and the folders that are empty then; nothing else."""
    with disk_explained("remove what was moved", frames):
        for sample in samples:
            _remove(frames / sample.folder, frames, is_tree=True)
        for place in {"/".join(sample.folder.split("/")[:2]) for sample in samples}:
            _remove(frames / place / "report.html", frames)
            _remove_empty(frames / place, frames)
        for album in list(album_folders(frames)):
            for picture in read_album(album).pictures:
                _remove(album / picture, frames, is_tree=True)
            for path in [p for p in album.iterdir() if p.is_file() and not p.name.startswith(".")]:
                _remove(path, frames)
            _remove_empty(album, frames)


def _remove(path: Path, frames: Path, *, is_tree: bool = False) -> None:
    if is_tree and path.is_dir():
        shutil.rmtree(path)
    elif not is_tree:
        path.unlink(missing_ok=True)
    _remove_empty(path.parent, frames)


def _remove_empty(folder: Path, frames: Path) -> None:
    while folder != frames and folder.is_dir():
        try:
            folder.rmdir()
        except OSError:  # something is in it
            return
        folder = folder.parent
