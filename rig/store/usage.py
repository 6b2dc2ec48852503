"""`rig store du`: what takes how much room."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.store.layout import ALBUM, ORPHANS, entries, is_sweep_folder, rig_folders, size_of

if TYPE_CHECKING:
    from rig.database import Store

CAPTURES = "captures"
BESIDE = (CAPTURES, "comparisons")
"""Folders beside the frames that verbs make by themselves."""


@dataclass(frozen=True, slots=True)
class RigUsage:
    """Room that one rig takes."""

    rig: str
    sweeps: int
    sweeps_bytes: int
    albums: int
    albums_bytes: int
    other_bytes: int


@dataclass(frozen=True, slots=True)
class Usage:
    """Room that a store takes."""

    database_bytes: int | None
    """None for a server."""
    rigs: tuple[RigUsage, ...]
    orphans_bytes: int
    """What `verify --repair` put aside."""
    beside_bytes: dict[str, int]
    """Captures and comparisons, which no row knows."""

    @property
    def total_bytes(self) -> int:
        """All of it."""
        rigs = sum(rig.sweeps_bytes + rig.albums_bytes + rig.other_bytes for rig in self.rigs)
        beside = sum(self.beside_bytes.values())
        return (self.database_bytes or 0) + rigs + self.orphans_bytes + beside


def usage(store: "Store") -> Usage:
    """Weigh a store.

    Raises:
        StoreError: a folder may not be read.
    """
    file = store.location.file
    beside = {name: size_of(store.frames.parent / name) for name in BESIDE}
    return Usage(
        None if file is None else sum(size_of(path) for path in file.parent.glob(f"{file.name}*")),
        tuple(_rig(folder) for folder in rig_folders(store.frames)),
        size_of(store.frames / ORPHANS),
        {name: size for name, size in beside.items() if size},
    )


def _rig(folder: Path) -> RigUsage:
    inner = entries(folder)
    sweeps = [path for path in inner if is_sweep_folder(path)]
    albums = [path for path in inner if path.name.startswith(ALBUM) and path.is_dir()]
    rest = [path for path in inner if path not in sweeps and path not in albums]
    return RigUsage(
        folder.name,
        len(sweeps),
        sum(map(size_of, sweeps)),
        len(albums),
        sum(map(size_of, albums)),
        sum(map(size_of, rest)),
    )
