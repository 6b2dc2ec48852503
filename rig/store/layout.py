"""What lies below the root of all frames, and what each name there means."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from rig.disk import disk_explained
from rig.folder_lock import LOCK_FILE

ORPHANS = ".orphans"
"""Where `verify --repair` puts what no row knows: nothing is thrown away."""
MARK = ".restoring.json"
"""In a root that is being filled by `restore` or `move`, until the database is in its place."""
_SWEEP = re.compile(r"^\d+_\d{8}-\d{6}(-\d+)?$")
_HALF_WRITTEN = re.compile(r"^\..*\.tmp$|^\.check-\d+$")
ALBUM = "calibration_"
PICTURES = "pictures.jsonl"
PRUNED = "pruned.json"
"""In an album whose pictures were given up on purpose: when."""


@dataclass(frozen=True, slots=True)
class Album:
    """Pictures of one calibration, as its list tells them."""

    folder: Path
    pictures: Mapping[str, Mapping[str, str]]
    """By folder of the picture: SHA-256 by name of the file."""
    damaged: tuple[str, ...]
    """Lines of the list that cannot be read."""
    is_pruned: bool = False
    """Whether its pictures were given up on purpose: it should have none."""


def entries(folder: Path) -> list[Path]:
    """Return what a folder holds, by name; nothing where it is none.

    Raises:
        StoreError: it may not be read.
    """
    if not folder.is_dir() or folder.is_symlink():
        return []
    with disk_explained("list", folder):
        return sorted(path for path in folder.iterdir() if path.name != LOCK_FILE)


def is_half_written(path: Path) -> bool:
    """Tell whether a killed program left it before it was whole."""
    return _HALF_WRITTEN.match(path.name) is not None


def is_sweep_folder(path: Path) -> bool:
    """Tell whether it is named as the folder of a sweep."""
    return _SWEEP.match(path.name) is not None and path.is_dir()


def rig_folders(frames: Path) -> Iterator[Path]:
    """Yield the folders of all rigs."""
    return (path for path in entries(frames) if path.is_dir() and not path.name.startswith("."))


def album_folders(frames: Path) -> Iterator[Path]:
    """Yield the folders of all calibrations."""
    for rig in rig_folders(frames):
        yield from (p for p in entries(rig) if p.name.startswith(ALBUM) and p.is_dir())


def read_album(folder: Path) -> Album:
    """Read which pictures an album has: none where they were pruned.

    A last line that was cut off is no picture.

    Raises:
        StoreError: its list may not be read.
    """
    if (folder / PRUNED).is_file():
        return Album(folder, {}, (), is_pruned=True)
    pictures: dict[str, Mapping[str, str]] = {}
    damaged: list[str] = []
    with disk_explained("read the list of pictures", folder):
        text = _text(folder / PICTURES)
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        if not line.endswith("\n"):
            continue
        found = _picture(line)
        if found is None:
            damaged.append(f"line {number} of {PICTURES} is none")
        else:
            pictures[found[0]] = found[1]
    return Album(folder, pictures, tuple(damaged))


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""


def _picture(line: str) -> tuple[str, dict[str, str]] | None:
    try:
        content = json.loads(line)
        frames = cast("list[dict[str, Any]]", content["frames"])
        files = {f"{frame['view']}.png": str(frame["sha256"]) for frame in frames}
        number = int(content["number"])
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    if any("/" in name or name.startswith(".") for name in files):
        return None
    return f"picture_{number:03d}", files


def size_of(path: Path) -> int:
    """Return how many bytes are in a file, or in all files below a folder; links are not followed.

    What vanishes meanwhile has none.
    """
    try:
        if path.is_symlink() or not path.is_dir():
            return path.lstat().st_size
        return sum(size_of(inner) for inner in path.iterdir())
    except FileNotFoundError:
        return 0
