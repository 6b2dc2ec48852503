"""`rig store verify --repair`: what is safe to put in order, and nothing else.

Whole pictures that no row knows are put aside, not thrown away: after a database was brought back
from an older copy they are the only trace of what was taken since.
"""

import shutil
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.database.leases import FRAMES
from rig.disk import disk_explained
from rig.errors import OwnedError
from rig.files import make_folder, sync_folder
from rig.store.layout import ORPHANS, entries, is_sweep_folder
from rig.store.verify import Finding, layout_findings

if TYPE_CHECKING:
    from rig.database import Store


@dataclass(frozen=True, slots=True)
class Repair:
    """What was done."""

    done: tuple[Finding, ...]
    refused: tuple[str, ...]
    """What belongs to a program that is at work, one line each."""
    aside: Path | None
    """Where orphans were put; None where there were none."""


def repair(store: "Store", findings: Sequence[Finding]) -> Repair:
    """Put in order what `verify` found and may be touched.

    Whatever belongs to a sweep or an album is touched as its owner only, after another look.

    Args:
        store: open.
        findings: of `verify`.

    Raises:
        OwnedError: another program copies or removes frames.
        StoreError: the store may only be read, or the disk fails.
    """
    wanted = {
        finding for finding in findings if finding.kind in ("orphan", "half-written", "pruned")
    }
    leases = [finding for finding in findings if finding.kind == "lease"]
    if leases:
        store.clear_dead_leases()
    if not wanted:
        return Repair(tuple(leases), (), None)
    aside = store.frames / ORPHANS / f"{datetime.now(UTC):%Y%m%d-%H%M%S-%f}"
    done, refused = list(leases), list[str]()
    with store.owned(FRAMES, store.frames, "asked to repair the store"):
        for lease in sorted({finding.lease for finding in wanted}):
            mine = {finding for finding in wanted if finding.lease == lease}
            try:
                with _ownership(store, lease, mine):
                    for finding in sorted(mine & set(layout_findings(store)), key=str):
                        _put_right(store, finding, aside)
                        done.append(finding)
            except OwnedError as error:
                refused.append(str(error))
    return Repair(tuple(done), tuple(refused), aside if aside.is_dir() else None)


def _ownership(store: "Store", lease: str, mine: set[Finding]) -> AbstractContextManager[None]:
    if not lease:
        return nullcontext()
    place = Path(next(iter(mine)).place)
    folder = store.frames / place.parts[0] / place.parts[1]
    return store.owned(lease, folder, f"asked to repair {lease}")


def _put_right(store: "Store", finding: Finding, aside: Path) -> None:
    path = store.frames / finding.place
    with disk_explained("repair", path):
        if finding.kind != "orphan":
            _remove(path)
            return
        if not is_sweep_folder(path):
            _put_aside(path, finding.place, aside, store.modes.folder)
            return
        with store.nothing_begins() as known:  # its row may be on its way
            if finding.place not in known:
                if not entries(path):
                    _remove(path)
                else:
                    _put_aside(path, finding.place, aside, store.modes.folder)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()
    sync_folder(path.parent)


def _put_aside(path: Path, place: str, aside: Path, mode: int) -> None:
    target = aside / place
    make_folder(target.parent, mode)
    path.rename(target)
    sync_folder(target.parent)
    sync_folder(path.parent)
