"""`rig store prune --of albums`: pictures of old calibrations go, their numbers and pages stay."""

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.database.leases import FRAMES
from rig.disk import disk_explained
from rig.errors import OwnedError
from rig.files import put_on_disk, sync_folder
from rig.store.layout import PRUNED, album_folders, entries, read_album, size_of
from rig.store.prune import PruneRequest, Verdict

if TYPE_CHECKING:
    from rig.database import Store
    from rig.records import StoredCalibration


@dataclass(frozen=True, slots=True)
class PrunableAlbum:
    """One calibration whose pictures would go."""

    calibration_id: int
    rig: str
    made_at: datetime
    verdict: Verdict
    """`missed` where runs do not take it by themselves."""
    folder: Path
    pictures: int
    bytes: int


def prunable_albums(store: "Store", request: PruneRequest) -> tuple[PrunableAlbum, ...]:
    """Return the albums whose pictures would go; nothing is changed.

    Never those that no stored calibration was made of: they are still to be gone on with, or their
    pictures are all that there is.

    Args:
        store: open.
        request: whose.
    """
    rows = {_place_of(row): row for row in store.history(store.frames).calibrations}
    at_work = store.owners()
    found: list[PrunableAlbum] = []
    for folder in album_folders(store.frames):
        row = rows.get((folder.parent.name, folder.name))
        if row is None or _lease(folder) in at_work:
            continue
        verdict: Verdict = "passed" if row.active else "missed"
        pictures = read_album(folder).pictures
        if pictures and request.is_met(row.created_at, row.rig, verdict):
            size = sum(size_of(folder / picture) for picture in pictures)
            facts = (row.id, row.rig, row.created_at, verdict, folder, len(pictures), size)
            found.append(PrunableAlbum(*facts))
    return tuple(sorted(found, key=lambda album: album.calibration_id))


def prune_albums(
    store: "Store", albums: Sequence[PrunableAlbum]
) -> tuple[tuple[PrunableAlbum, ...], tuple[str, ...]]:
    """Remove the pictures of albums, each as its owner.

    First the album says that they are gone: killed in between, what is left is removed by
    `verify --repair`, and nobody takes it for damage.

    Args:
        store: open.
        albums: of `prunable_albums`.

    Returns:
        The albums whose pictures went, and a line for each that belongs to a program at work.

    Raises:
        OwnedError: another program copies or removes frames.
        StoreError: the store may only be read, or the disk fails.
    """
    done, refused = list[PrunableAlbum](), list[str]()
    with store.owned(FRAMES, store.frames, "asked to prune"):
        for album in albums:
            asked = f"asked to prune the pictures of calibration {album.calibration_id}"
            try:
                with store.owned(_lease(album.folder), album.folder, asked):
                    _remove(album.folder, store.modes.file)
                done.append(album)
            except OwnedError as error:
                refused.append(str(error))
    return tuple(done), tuple(refused)


def _remove(folder: Path, mode: int) -> None:
    with disk_explained("prune", folder):
        pruned_at = datetime.now(UTC).isoformat(timespec="seconds")
        put_on_disk(folder / PRUNED, json.dumps({"pruned_at": pruned_at}).encode(), mode)
        for path in entries(folder):
            if path.is_dir() and path.name.startswith("picture_"):
                shutil.rmtree(path)
        sync_folder(folder)


def _place_of(row: "StoredCalibration") -> tuple[str, str]:
    """Rig and name of the folder: the store may have moved since, names stay."""
    return row.rig, Path(str(row.quality.get("folder", ""))).name


def _lease(folder: Path) -> str:
    return f"album {folder.parent.name}/{folder.name}"
