"""`rig store migrate`: the same rows in another database, as SQLite to PostgreSQL and back."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.database.leases import STORE
from rig.database.location import Location
from rig.database.store import open_at
from rig.disk import disk_explained
from rig.errors import StoreError
from rig.files import make_folder
from rig.store.copy_frames import Copied, FrameCopy, Progress

if TYPE_CHECKING:
    from rig.database import Store


@dataclass(frozen=True, slots=True)
class Migrated:
    """The same rows in another database."""

    source: str
    target: str
    frames: Path
    rows: dict[str, int]
    copied: Copied | None
    """None where both databases use the same frames."""


def migrate(
    store: "Store",
    location: Location,
    progress: Progress = lambda *_: None,
    *,
    copies_frames: bool = False,
) -> Migrated:
    """Copy all rows into another, empty database: all of them, or none.

    The old one is left as it is.

    Args:
        store: open.
        location: of the new one.
        progress: told how many folders of images are done.
        copies_frames: whether the frames are copied to where the new one looks for them.

    Raises:
        OwnedError: a program works on a part of the store.
        StoreError: the new one is not empty, would look for frames elsewhere, cannot be written, or
            gives rows back otherwise.
    """
    if location.url == store.location.url:
        raise StoreError(
            f"asked to migrate {store.database} into itself", advice="name another database"
        )
    shares = location.frames.absolute() == store.frames.absolute()
    if not shares and not copies_frames:
        raise StoreError(
            f"{location}: would look for frames in {location.frames}, they are in {store.frames}",
            advice=f"set RIG_FRAMES={store.frames} for both, or give --copy-frames",
        )
    with disk_explained("migrate", store.frames):
        make_folder(store.frames, store.modes.folder)
    with store.owned(STORE, store.frames, "asked to migrate the store"):
        copied = None
        with open_at(location) as target:
            if not target.is_empty():
                raise StoreError(
                    f"{location}: asked to migrate into an empty database, found rows in it",
                    advice="name one that is not there yet",
                )
            if not shares:
                copy = FrameCopy(store.frames, location.frames, location.modes, progress)
                copy.samples(store.sample_files())
                copy.albums()
                copied = copy.copied
            rows = store.copy_into(target)
    return Migrated(store.database, str(location), location.frames, rows, copied)
