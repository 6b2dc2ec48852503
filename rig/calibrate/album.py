"""Pictures of one calibration on disk, kept as they are taken, so that a crash loses none.

    <frames>/<rig>/calibration_<UTC>/picture_000/<view>.png
                                     pictures.jsonl   one line per picture: number, stage, times
                                     profile.json     the rig as it was
                                     calibration.json, calibration.html   once it is solved

The `folder` camera replays them by the pattern `picture_*/<view>.png`.
"""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rig.calibrate.pictures import Picture
from rig.database.frames import FrameWriter, read_frames
from rig.database.trouble import explained
from rig.errors import ConfigError, StoreError
from rig.json_codec import Codec
from rig.profile import Profile
from rig.profile.load import parse_profile
from rig.records import StoredFrame

_SAME = ("name", "views", "camera", "target")
"""Parts of a profile in which a resumed calibration must not differ."""
SOLVED = "calibration.json"


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

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @classmethod
    def new(cls, frames: Path, profile: Profile) -> "Album":
        """Make an empty one.

        Args:
            frames: folder below which all frames are.
            profile: the rig.

        Raises:
            StoreError: it cannot be written.
        """
        folder = frames / profile.name / f"calibration_{datetime.now(UTC):%Y%m%d-%H%M%S-%f}"
        with explained("keep the pictures of a calibration", folder):
            folder.mkdir(parents=True)
            _write(folder / "profile.json", profile.model_dump_json(indent=2))
        return cls(folder)

    @classmethod
    def unfinished(cls, frames: Path, profile: Profile) -> "Album":
        """Return the newest one of a rig that has not been solved.

        Raises:
            ConfigError: there is none, or the rig has changed since.
            StoreError: it cannot be read.
        """
        folders = sorted((frames / profile.name).glob("calibration_*"))
        open_ones = [f for f in folders if f.is_dir() and not (f / SOLVED).exists()]
        if not open_ones:
            raise ConfigError(
                f"asked to resume a calibration of {profile.name}, none is unfinished; "
                f"rig calibrate {profile.name} begins one"
            )
        album = cls(open_ones[-1])
        file = album.folder / "profile.json"
        with explained("resume a calibration", file):
            before = parse_profile(json.loads(file.read_text(encoding="utf-8")), source=str(file))
        changed = profile.first_difference(before, _SAME)
        if changed is not None:
            raise ConfigError(
                f"asked to resume the calibration in {album.folder}: {changed} of the profile has "
                "changed since; undo that, or begin a new calibration"
            )
        return album

    def keep(self, picture: Picture) -> None:
        """Store a picture: on the disk when this returns.

        Raises:
            StoreError: it cannot be written.
        """
        with FrameWriter(self._place(picture.number)) as writer:
            stored = writer.write(picture.multiview)
            writer.publish()
        kept = _Line(picture.number, picture.stage_mm, picture.multiview.temperature_degc, stored)
        line = json.dumps(_LINE.to_json(kept)) + "\n"
        file = self.folder / "pictures.jsonl"
        with explained("keep a picture", file):
            _write(file, "".join([*self._whole_lines(), line]))

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
            _write(file, text)
        return file

    def _whole_lines(self) -> list[str]:
        """Lines of the list of pictures; one that was cut off has no picture and is left out."""
        file = self.folder / "pictures.jsonl"
        if not file.exists():
            return []
        with explained("read pictures", file):
            lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
        return [line for line in lines if line.endswith("\n")]

    def _place(self, number: int) -> Path:
        return self.folder / f"picture_{number:03d}"


def _write(file: Path, text: str) -> None:
    beside = file.with_name(f".{file.name}.tmp")
    with beside.open("w", encoding="utf-8") as written:
        written.write(text)
        written.flush()
        os.fsync(written.fileno())
    beside.replace(file)
