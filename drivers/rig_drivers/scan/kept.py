"""Takes of one scan: in memory, or each on the disk before the next move.

<scans>/<UTC>/plan.json       what is to be taken, and with what
              take_003.png    the picture, as it came from the camera
              take_003.json   where and when; there only when the picture is
              end.json        `complete`, or `moved` where the scene did
"""

import hashlib
import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol, cast

import cv2
import numpy as np

from rig.disk import disk_explained
from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.files import make_folder, put_on_disk
from rig.folder_lock import FolderLock
from rig.frames import Frame, GreyImage
from rig.json_codec import Codec
from rig.profile.kinds import ScanKeeping
from rig_drivers.scan.route import Halt

_PLAN, _END, _TAKES = "plan.json", "end.json", "take_[0-9][0-9][0-9].json"


@dataclass(frozen=True, slots=True)
class Kept:
    """One take that was taken."""

    halt: Halt
    reached_mm: tuple[float, ...]
    """Positions read back, of each carrier."""
    frame: Frame
    session: int
    temperature_degc: float | None


class Keeping(Protocol):
    """Where the takes of one scan are."""

    @property
    def taken(self) -> tuple[Kept, ...]:
        """What there is, in the order in which it was taken."""
        ...

    @property
    def session(self) -> int:
        """Number of this session: 0 for a scan that was begun by it."""
        ...

    @property
    def folder(self) -> Path | None:
        """Where pictures may be put; None where nothing is on the disk."""
        ...

    def keep(self, take: Kept) -> None:
        """Add a take; when this returns it is kept.

        Raises:
            StoreError: it cannot be written.
        """
        ...

    def end(self, state: str) -> None:
        """Write down how the scan ended."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class InMemory:
    """Keeps nothing beyond the program: where a scan is one sample of something else."""

    session = 0
    folder = None

    def __init__(self) -> None:
        self._taken: list[Kept] = []

    @property
    def taken(self) -> tuple[Kept, ...]:
        """See `Keeping.taken`."""
        return tuple(self._taken)

    def keep(self, take: Kept) -> None:
        """See `Keeping.keep`."""
        self._taken.append(take)

    def end(self, state: str) -> None:
        """See `Keeping.end`."""

    def close(self) -> None:
        """See `Keeping.close`."""


@dataclass(frozen=True, slots=True)
class _Line:
    """What `take_NNN.json` tells."""

    view: str
    role: str
    places_mm: tuple[float, ...]
    reached_mm: tuple[float, ...]
    session: int
    temperature_degc: float | None
    timestamp_s: float
    utc: str
    sequence: int
    exposure_s: float | None
    bits: int | None
    uncertainty_s: float
    sha256: str


_TAKEN_AGAIN = "take this file away: the view is taken again"
_LINE = Codec(_Line, name="take", error=StoreError, advice=_TAKEN_AGAIN)


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
            self._taken = _read_all(folder, now_s)
        except BaseException:
            self._lock.release()
            raise
        # One that was taken away leaves a gap: no number is used twice.
        numbers = [int(file.stem.rpartition("_")[2]) for file in folder.glob(_TAKES)]
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
        frame = take.frame
        done, encoded = cv2.imencode(".png", frame.image)
        if not done:
            raise StoreError(
                f"{file}: the take could not be turned into a PNG",
                advice="report it with the type and shape of the frame",
            )
        content = encoded.tobytes()
        line = _Line(
            view=take.halt.view,
            role=take.halt.role,
            places_mm=take.halt.places_mm,
            reached_mm=take.reached_mm,
            session=take.session,
            temperature_degc=take.temperature_degc,
            timestamp_s=frame.timestamp_s,
            utc=datetime.now(UTC).isoformat(),
            sequence=frame.sequence,
            exposure_s=frame.exposure_s,
            bits=frame.bits,
            uncertainty_s=frame.uncertainty_s,
            sha256=hashlib.sha256(content).hexdigest(),
        )
        text = json.dumps(_LINE.to_json(line), indent=1)
        with disk_explained("keep a take", file):
            put_on_disk(file, content, self._modes.file)
            put_on_disk(file.with_suffix(".json"), text.encode(), self._modes.file)
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
        make_folder(folder, modes.folder)
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


def _read_all(folder: Path, now_s: float) -> list[Kept]:
    """Read every take that counts, with its times on the clock of this session.

    A clock that began anew says nothing of before: the wall clock tells how long ago the last take
    of a session was, and the others keep their distance from it.
    """
    found = [_read(file) for file in sorted(folder.glob(_TAKES))]
    moved: list[Kept] = []
    for take, _ in found:
        last, utc = [one for one in found if one[0].session == take.session][-1]
        ago_s = (datetime.now(UTC) - utc).total_seconds()
        shift_s = now_s - ago_s - last.frame.timestamp_s
        frame = replace(take.frame, timestamp_s=take.frame.timestamp_s + shift_s)
        moved.append(replace(take, frame=frame))
    return moved


def _read(file: Path) -> tuple[Kept, datetime]:
    picture = file.with_suffix(".png")
    with disk_explained("read a take", file):
        text, content = file.read_bytes(), picture.read_bytes()
    try:
        line = _LINE.from_text(text.decode(errors="replace"))
        utc = datetime.fromisoformat(line.utc).astimezone(UTC)
    except (StoreError, ValueError) as error:
        raise StoreError(
            f"{file}: does not describe a take of a scan", advice=_TAKEN_AGAIN
        ) from error
    if hashlib.sha256(content).hexdigest() != line.sha256:
        raise StoreError(
            f"{picture}: the take is damaged or was changed after it was stored "
            f"({len(content)} bytes, wrong SHA-256)",
            advice=f"take {file.name} away: the view is taken again",
        )
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    frame = Frame(
        view=line.view,
        image=cast("GreyImage", image),
        timestamp_s=line.timestamp_s,
        sequence=line.sequence,
        exposure_s=line.exposure_s,
        bits=line.bits,
        uncertainty_s=line.uncertainty_s,
    )
    halt = Halt(line.view, line.role, line.places_mm)
    take = Kept(halt, line.reached_mm, frame, line.session, line.temperature_degc)
    return take, utc
