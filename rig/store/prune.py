"""`rig store prune`: images of old sweeps go, slopes and curves stay.

Albums of calibrations and captures: `rig.store.prune_albums`, `rig.store.prune_captures`.
"""

import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rig.database.leases import FRAMES
from rig.disk import disk_explained
from rig.errors import OwnedError
from rig.files import sync_folder
from rig.store.layout import size_of

if TYPE_CHECKING:
    from rig.database import Store
    from rig.records import HistoryRow

Verdict = Literal["passed", "missed", "failed"]
"""`passed`: its curve is good. `missed`: it missed a gate. `failed`: it has no curve."""


@dataclass(frozen=True, slots=True)
class PruneRequest:
    """Whose images go; what is None is not asked."""

    before: datetime | None = None
    """Only what ended earlier."""
    rig: str | None = None
    verdict: Verdict | None = None

    def is_met(self, ended_at: datetime, rig: str, verdict: Verdict | None) -> bool:
        """Tell whether something is meant; a verdict that was asked for is not met by none."""
        return (
            (self.before is None or ended_at < self.before)
            and self.rig in (None, rig)
            and self.verdict in (None, verdict)
        )


@dataclass(frozen=True, slots=True)
class Prunable:
    """One sweep whose images would go."""

    sweep_id: int
    rig: str
    started_at: datetime
    verdict: Verdict
    samples: int
    """That have images."""
    bytes: int


@dataclass(frozen=True, slots=True)
class Pruned:
    """What was done."""

    sweeps: tuple[Prunable, ...]
    refused: tuple[str, ...]
    """What belongs to a program that is at work, one line each."""


def prunable(store: "Store", request: PruneRequest) -> tuple[Prunable, ...]:
    """Return the sweeps whose images would go; nothing is changed.

    Never those that are still to be gone on with or concluded, nor those at work.

    Args:
        store: open.
        request: whose.
    """
    folders: dict[int, list[Path]] = {}
    for sample in store.sample_places():
        if not sample.is_pruned:
            folders.setdefault(sample.sweep_id, []).append(store.frames / sample.folder)
    found: list[Prunable] = []
    for row in store.history(store.frames).sweeps:
        verdict = verdict_of(row)
        if verdict is None or row.at_work is not None or row.id not in folders:
            continue
        if request.is_met(row.ended_at or row.started_at, row.rig, verdict):
            own = folders[row.id]
            size = sum(map(size_of, own))
            found.append(Prunable(row.id, row.rig, row.started_at, verdict, len(own), size))
    return tuple(found)


def prune(store: "Store", sweeps: Sequence[Prunable]) -> Pruned:
    """Remove the images of sweeps, each as its owner.

    First the rows say that they are gone: killed in between, what is left on the disk is removed by
    `verify --repair`, and nobody takes it for damage.

    Args:
        store: open.
        sweeps: of `prunable`.

    Raises:
        OwnedError: another program copies or removes frames.
        StoreError: the store may only be read, or the disk fails.
    """
    done, refused = list[Prunable](), list[str]()
    with store.owned(FRAMES, store.frames, "asked to prune"):
        for sweep in sweeps:
            try:
                with store.owned_sweep(sweep.sweep_id, f"asked to prune sweep {sweep.sweep_id}"):
                    store.mark_pruned(sweep.sweep_id)
                    _remove(store, sweep.sweep_id)
                done.append(sweep)
            except OwnedError as error:
                refused.append(str(error))
    return Pruned(tuple(done), tuple(refused))


def verdict_of(row: "HistoryRow") -> Verdict | None:
    """Return how a sweep ended; None for one that has not."""
    match row.state:
        case "concluded":
            return "passed" if row.is_active else "missed"
        case "failed":
            return "failed"
        case _:
            return None


def _remove(store: "Store", sweep_id: int) -> None:
    for sample in store.sample_places():
        if sample.sweep_id != sweep_id or not sample.is_pruned:
            continue
        folder = store.frames / sample.folder
        with disk_explained("prune", folder):
            if folder.is_dir():
                shutil.rmtree(folder)
            with suppress(OSError):  # other samples of the stop, or files of somebody else
                folder.parent.rmdir()
    root = store.sweep(sweep_id).folder
    with disk_explained("prune", root):
        sync_folder(root)
