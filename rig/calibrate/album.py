"""Pictures of one calibration on disk, kept as they are taken, so that a crash loses none.

    <frames>/<rig>/calibration_<UTC>/picture_000/<view>.png
                                     pictures.jsonl   one line per picture: number, stage, times
                                     profile.json     the rig as it was
                                     calibration.json, calibration.html   once it is solved

The `folder` camera replays them by the pattern `picture_*/<view>.png`.
"""

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rig.calibrate.pictures import Picture
from rig.database.frames import FrameWriter, read_frames
from rig.database.trouble import explained
from rig.errors import ConfigError, StoreError
from rig.file_modes import FileModes
from rig.files import make_folder, put_on_disk, sync_folder, unused
from rig.json_codec import Codec
from rig.profile import Profile
from rig.profile.load import parse_profile
from rig.records import StoredFrame

_SAME = ("name", "views", "camera", "target")
"""Parts of a profile in which a resumed calibration must not differ."""
SOLVED = "calibration.json"
_PROFILE = "profile.json"
_LIST = "pictures.jsonl"
_PRIVATE = FileModes()


@dataclass(frozen=True, slots=True)
class _Line:
    """What the list of pictures tells of one."""

    number: int
    stage_mm: float | None
    temperature_degc: float | None
    frames: tuple[StoredFrame, ...]


_LINE = Codec(
    _Line, name="line of pictures.jsonl", error=StoreError, advice="take the line out of the file"
)


class Album:
    """The folder of one calibration."""

    def __init__(self, folder: Path, modes: FileModes) -> None:
        self.folder = folder
        self._modes = modes

    @classmethod
    def new(cls, frames: Path, profile: Profile, modes: FileModes = _PRIVATE) -> "Album":
        """Make an empty one; killed at any moment, there is none, or one that can be resumed.

        Args:
            frames: folder below which all frames are.
            profile: the rig.
            modes: permission bits of what is stored.

        Raises:
            StoreError: it cannot be written.
        """
        begun = f"calibration_{datetime.now(UTC):%Y%m%d-%H%M%S-%f}"
        folder = unused(frames / profile.name / begun)
        with explained("keep the pictures of a calibration", folder):
            beside = folder.with_name(f".{folder.name}.tmp")
            make_folder(beside, modes.folder)
            content = profile.model_dump_json(indent=2).encode()
            put_on_disk(beside / _PROFILE, content, modes.file)
            beside.rename(folder)
            sync_folder(folder.parent)
        return cls(folder, modes)

    @classmethod
    def unfinished(cls, frames: Path, profile: Profile, modes: FileModes = _PRIVATE) -> "Album":
        """Return the newest one of a rig that has not been solved.

        Raises:
            ConfigError: there is none, or the rig has changed since.
            StoreError: it cannot be read.
        """
        folders = sorted((frames / profile.name).glob("calibration_*"))
        # One without profile and list was killed as it began, by a rig that made it in two steps.
        begun = [f for f in folders if (f / _PROFILE).exists() or (f / _LIST).exists()]
        open_ones = [folder for folder in begun if not (folder / SOLVED).exists()]
        if not open_ones:
            raise ConfigError(
                f"asked to resume a calibration of {profile.name}, none is unfinished",
                advice=f"rig calibrate {profile.name} begins one",
            )
        album = cls(open_ones[-1], modes)
        file = album.folder / _PROFILE
        with explained("resume a calibration", file):
            before = parse_profile(json.loads(file.read_text(encoding="utf-8")), source=str(file))
        changed = profile.first_difference(before, _SAME)
        if changed is not None:
            raise ConfigError(
                f"asked to resume the calibration in {album.folder}: {changed} of the profile has "
                "changed since",
                advice="undo that, or begin a new calibration",
            )
        return album

    @property
    def lease(self) -> str:
        """What the lease of whoever works on it is called."""
        return f"album {self.folder.parent.name}/{self.folder.name}"

    @property
    def is_empty(self) -> bool:
        """Whether no picture has been kept in it."""
        return not self._whole_lines()

    def discard_if_empty(self) -> None:
        """Remove it where it holds no picture: the next `--resume` would take it for the newest.

        Raises:
            StoreError: it may not be removed.
        """
        if not self.is_empty or not self.folder.is_dir():
            return
        with explained("remove an empty album", self.folder):
            shutil.rmtree(self.folder)

    def keep(self, picture: Picture) -> None:
        """Store a picture: on the disk when this returns.

        Raises:
            StoreError: it cannot be written.
        """
        with FrameWriter(self._place(picture.number), self.folder, self._modes) as writer:
            stored = writer.write(picture.multiview)
            writer.publish()
        kept = _Line(picture.number, picture.stage_mm, picture.multiview.temperature_degc, stored)
        line = json.dumps(_LINE.to_json(kept)) + "\n"
        file = self.folder / _LIST
        with explained("keep a picture", file):
            put_on_disk(file, "".join([*self._whole_lines(), line]).encode(), self._modes.file)

    def pictures(self) -> Iterator[Picture]:
        """Yield the stored pictures, exactly as they were taken.

        Raises:
            StoreError: one is missing or damaged, or its line is.
        """
        for text in self._whole_lines():
            line = _LINE.from_text(text)
            multiview = read_frames(self._place(line.number), line.frames, line.temperature_degc)
            yield Picture(line.number, multiview, line.stage_mm)

    def write(self, name: str, text: str) -> Path:
        """Write a file of results: there completely or not at all.

        Raises:
            StoreError: it cannot be written.
        """
        file = self.folder / name
        with explained("write a calibration", file):
            put_on_disk(file, text.encode(), self._modes.file)
        return file

    def _whole_lines(self) -> list[str]:
        """Lines of the list of pictures; one that was cut off has no picture and is left out."""
        file = self.folder / _LIST
        if not file.exists():
            return []
        with explained("read pictures", file):
            lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
        return [line for line in lines if line.endswith("\n")]

    def _place(self, number: int) -> Path:
        return self.folder / f"picture_{number:03d}"
