"""Takes of one scan on the disk, each before the next move.

<scans>/<UTC>/plan.json       what is to be taken, and with what
              take_003.png    see `take_file`
              take_003.json
              end.json        `complete`, or `moved` where the scene did
"""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import cast

from rig.disk import disk_explained
from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.files import make_new_folder, put_on_disk
from rig.folder_lock import FolderLock
from rig.profile.kinds import ScanKeeping
from rig_drivers.scan.kept import InMemory, Kept
from rig_drivers.scan.take_file import TAKES, read_takes, write_take

_PLAN, _END = "plan.json", "end.json"


class OnDisk:
    """A folder that belongs to this program until it is closed.

    Args:
        folder: is there, with its plan.
        modes: permission bits of what is written.
        now_s: on the clock of the bench; times of earlier sessions are told on it.

    Raises:
        OwnedError: another program works on it.
        StoreError: a take in it is damaged, or it cannot be read.
    """

    def __init__(self, folder: Path, modes: FileModes, now_s: float) -> None:
        self.folder = folder
        self._modes = modes
        self._lock = FolderLock(folder, mode=modes.file)
        try:
            self._taken = read_takes(folder, now_s)
        except BaseException:
            self._lock.release()
            raise
        # One that was taken away leaves a gap: no number is used twice.
        numbers = [int(file.stem.rpartition("_")[2]) for file in folder.glob(TAKES)]
        self._next = max(numbers, default=-1) + 1
        self.session = max((take.session + 1 for take in self._taken), default=0)

    @property
    def taken(self) -> tuple[Kept, ...]:
        """See `Keeping.taken`."""
        return tuple(self._taken)

    def keep(self, take: Kept) -> None:
        """See `Keeping.keep`: the picture first, then the line that makes it count."""
        self._lock.require()
        file = self.folder / f"take_{self._next:03d}.png"
        write_take(file, take, self._modes.file)
        self._taken.append(take)
        self._next += 1

    def end(self, state: str) -> None:
        """See `Keeping.end`."""
        with disk_explained("end a scan", self.folder):
            put_on_disk(self.folder / _END, json.dumps({"state": state}).encode(), self._modes.file)

    def close(self) -> None:
        """See `Keeping.close`."""
        self._lock.release()


def begin(keeping: ScanKeeping | None, plan: object, now_s: float) -> InMemory | OnDisk:
    """Begin a scan.

    Args:
        keeping: where its takes go; None for memory.
        plan: what is to be taken, as JSON data.
        now_s: on the clock of the bench.

    Raises:
        StoreError: the folder cannot be made.
    """
    if keeping is None:
        return InMemory()
    modes = FileModes(keeping.file_mode)
    folder = keeping.folder / f"{datetime.now(UTC):%Y%m%d-%H%M%S-%f}"
    with disk_explained("begin a scan", folder):
        folder = make_new_folder(folder, modes.folder)
        put_on_disk(folder / _PLAN, json.dumps(plan, indent=1).encode(), modes.file)
    return OnDisk(folder, modes, now_s)


def go_on(keeping: ScanKeeping, plan: object, now_s: float) -> OnDisk:
    """Go on with the newest scan whose scene did not move; a complete one misses nothing.

    Raises:
        OwnedError: another program works on it.
        StoreError: there is none, or it was to be another scan.
    """
    asked = f"asked to resume a scan in {keeping.folder}"
    folders = sorted(file.parent for file in keeping.folder.glob(f"*/{_PLAN}"))
    usable = [folder for folder in folders if _state(folder) != "moved"]
    if not usable:
        raise StoreError(f"{asked}, there is none", advice="begin one: leave out --resume")
    folder = usable[-1]
    with disk_explained("resume a scan", folder):
        before = _json(folder / _PLAN)
    if before != json.loads(json.dumps(plan)):
        raise StoreError(
            f"{asked}, {folder.name} was begun with other positions or another camera",
            advice="undo the change of the profile, or begin a new scan: leave out --resume",
        )
    return OnDisk(folder, FileModes(keeping.file_mode), now_s)


def _state(folder: Path) -> str:
    file = folder / _END
    if not file.is_file():
        return "begun"
    with disk_explained("look how a scan ended", file):
        data = _json(file)
    state = cast("dict[str, object]", data).get("state") if isinstance(data, dict) else None
    return str(state)


def _json(file: Path) -> object:
    try:
        return json.loads(file.read_bytes())
    except ValueError as error:
        raise StoreError(
            f"{file}: is no JSON ({error})", advice="take this scan away and begin a new one"
        ) from error
