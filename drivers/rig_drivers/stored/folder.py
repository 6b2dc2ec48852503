"""Stored images as a camera: files or a video per view, found by name or pattern."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.devices import Clock
from rig.errors import ConfigError, DeviceLostError, DeviceNotFoundError
from rig.frames import Frame, GreyImage, MultiView
from rig.profile import FolderCameraConfig, ViewConfig
from rig_drivers.stored.camera import StoredCamera
from rig_drivers.stored.picture import read_grey
from rig_drivers.stored.video import SUFFIXES, StoredVideo

_NAME = "camera folder"


class FolderCamera(StoredCamera):
    """Gives every stored multi-view once, in the order of its file names; keeps `Camera`.

    Numbers inside names sort as numbers: `img_2` comes before `img_10`. Patterns may reach into
    folders, so that the frames of a sweep are a camera too: `stop_*/sample_*/left.png`. One video
    per view is a camera as well; its pictures are taken in order.

    The timestamp of a multi-view is the time of reading.

    Args:
        config: file name or pattern of every view.
        views: views of the profile; their order is the order of the frames.
        root: the folder that the patterns start from.
        clock: gives the timestamps.
    """

    def __init__(
        self, config: FolderCameraConfig, views: Sequence[ViewConfig], *, root: Path, clock: Clock
    ) -> None:
        super().__init__(_NAME, root, views)
        self._config = config
        self._clock = clock
        self._multiviews: list[tuple[_Stored, ...]] = []
        self._videos: dict[Path, StoredVideo] = {}
        self._like: GreyImage | None = None

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": "folder", "model": "stored images", "serial": str(self._place)}

    def _open(self) -> None:
        self._multiviews = self._find()
        self._like = None

    def _close(self) -> None:
        self._multiviews = []
        for video in self._videos.values():
            video.close()
        self._videos.clear()

    def _read(self, number: int) -> MultiView | None:
        if number >= len(self._multiviews):
            return None
        images = [self._picture(picture) for picture in self._multiviews[number]]
        read_s = self._clock.now_s()
        return MultiView(
            tuple(
                Frame(view, image, timestamp_s=read_s, sequence=number)
                for view, image in zip(self._views, images, strict=True)
            )
        )

    def _find(self) -> "list[tuple[_Stored, ...]]":
        if not self._place.is_dir():
            raise DeviceNotFoundError(
                _NAME, f"{self._place} is no folder", advice="set camera.folder"
            )
        found = {view: self._matches(view) for view in self._views}
        counts = {view: len(pictures) for view, pictures in found.items()}
        if len(set(counts.values())) > 1:
            listed = ", ".join(f"{view} {count}" for view, count in counts.items())
            raise DeviceNotFoundError(
                _NAME,
                f"views of {self._place} differ in their number of pictures: {listed}",
                advice="remove what has no partner, or correct camera.files",
            )
        return list(zip(*found.values(), strict=True))

    def _matches(self, view: str) -> "list[_Stored]":
        pattern = self._config.files[view]
        try:
            paths = [path for path in self._place.glob(pattern) if path.is_file()]
        except (ValueError, NotImplementedError) as error:
            raise ConfigError(
                f"camera.files.{view}: {pattern!r} is no pattern below {self._place}: {error}",
                advice="write it as in views/left*.png",
            ) from error
        if not paths:
            raise DeviceNotFoundError(
                _NAME,
                f"no file for view {view}: {pattern!r} matches nothing in {self._place}",
                advice="correct camera.files",
            )
        paths = sorted(paths, key=lambda path: _natural(path.relative_to(self._place)))
        return [stored for path in paths for stored in self._pictures_in(path)]

    def _pictures_in(self, path: Path) -> "list[_Stored]":
        if path.suffix.lower() not in SUFFIXES:
            return [_Stored(path)]
        if path not in self._videos:
            self._videos[path] = StoredVideo(path)
        return [_Stored(path, number) for number in range(len(self._videos[path]))]

    def _picture(self, stored: "_Stored") -> GreyImage:
        path = stored.path
        if stored.number is None:
            image = read_grey(path)
        else:
            image = self._videos[path].picture(stored.number)
        if self._like is None:
            self._like = image
        elif image.shape != self._like.shape or image.dtype != self._like.dtype:
            raise DeviceLostError(
                _NAME,
                f"{path} is {_size(image)}, the first image is {_size(self._like)}",
                advice="all views of a camera must be alike",
            )
        return image


@dataclass(frozen=True, slots=True)
class _Stored:
    """Where one picture of one view is."""

    path: Path
    number: int | None = None
    """Which picture of a video; None for an image."""


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort key in which numbers count as numbers."""
    pieces = re.findall(r"\d+|\D+", path.as_posix())
    return [(int(piece), "") if piece.isdecimal() else (-1, piece) for piece in pieces]


def _size(image: GreyImage) -> str:
    height, width = image.shape[:2]
    return f"{width} x {height} px, {8 * image.dtype.itemsize} bit"
