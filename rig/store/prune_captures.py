"""`rig store prune --of captures`: old captures beside the frames go, with their recordings.

Only those in the folder that captures without `--out` are put into; what was put elsewhere is its
owner's. Nothing is kept of them.
"""

import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.disk import disk_explained
from rig.errors import OwnedError
from rig.files import sync_folder
from rig.folder_lock import FolderLock
from rig.store.layout import entries, size_of
from rig.store.prune import PruneRequest
from rig.store.usage import CAPTURES

if TYPE_CHECKING:
    from rig.database import Store

_NAME = re.compile(r"^(?P<rig>[^.].*)_(?P<begun>\d{8}-\d{6})(-\d{6})?(-\d+)?$")
_MADE_BY_CAPTURE = ("frames.jsonl", "run.json", "*.mcap")
"""One of these is in every folder of a capture; others are somebody else's."""
_GOING = ".pruned_"
"""Before the name of a folder whose removal has begun."""


@dataclass(frozen=True, slots=True)
class PrunableCapture:
    """One capture that would go."""

    folder: Path
    rig: str
    begun_at: datetime
    bytes: int


def prunable_captures(store: "Store", request: PruneRequest) -> tuple[PrunableCapture, ...]:
    """Return the captures that would go; nothing is changed. None has a verdict.

    Args:
        store: open.
        request: whose; what they ended at is when they were last written to.
    """
    found: list[PrunableCapture] = []
    for folder in entries(store.frames.parent / CAPTURES):
        name = _NAME.match(folder.name)
        if name is None or folder.is_symlink() or not _is_capture(folder):
            continue
        begun_at = _begun_at(name["begun"])
        if begun_at is not None and request.is_met(_ended_at(folder), name["rig"], None):
            found.append(PrunableCapture(folder, name["rig"], begun_at, size_of(folder)))
    return tuple(found)


def prune_captures(
    store: "Store", captures: Sequence[PrunableCapture]
) -> tuple[tuple[PrunableCapture, ...], tuple[str, ...]]:
    """Remove captures; one that was cut short, here or before, is no longer taken for a capture.

    Args:
        store: open.
        captures: of `prunable_captures`.

    Returns:
        The captures that went, and a line for each that a program writes into.

    Raises:
        StoreError: the disk fails, or may only be read.
    """
    done, refused = list[PrunableCapture](), list[str]()
    root = store.frames.parent / CAPTURES
    for capture in captures:
        going = capture.folder.with_name(f"{_GOING}{capture.folder.name}")
        try:
            with disk_explained("prune", capture.folder), FolderLock(capture.folder):
                capture.folder.rename(going)
        except OwnedError as error:
            refused.append(str(error))
        else:
            done.append(capture)
    for folder in _going(root):
        with disk_explained("prune", folder):
            shutil.rmtree(folder)
    if done:
        with disk_explained("prune", root):
            sync_folder(root)
    return tuple(done), tuple(refused)


def _going(root: Path) -> Iterator[Path]:
    for path in entries(root):
        name = path.name.removeprefix(_GOING)
        if name != path.name and _NAME.match(name) and path.is_dir() and not path.is_symlink():
            yield path


def _is_capture(folder: Path) -> bool:
    return folder.is_dir() and any(
        next(folder.glob(pattern), None) is not None for pattern in _MADE_BY_CAPTURE
    )


def _begun_at(text: str) -> datetime | None:
    try:
        return datetime.strptime(text, "%Y%m%d-%H%M%S").replace(tzinfo=UTC)
    except ValueError:
        return None


def _ended_at(folder: Path) -> datetime:
    """When its newest file was written."""
    newest_s = max((path.lstat().st_mtime for path in entries(folder)), default=0.0)
    return datetime.fromtimestamp(newest_s, UTC)
