"""Stored images as a camera: files or a video per view, found by name or pattern."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.devices import Clock
from rig.errors import ConfigError, DeviceLostError, DeviceNotFoundError
from rig.frames import Frame, GreyImage, MultiView
from rig.profile import FolderCameraConfig, Region, ViewConfig, regions_in
from rig_drivers.split import cut
from rig_drivers.stored.camera import StoredCamera
from rig_drivers.stored.picture import Picture, read_picture
from rig_drivers.stored.video import SUFFIXES, StoredVideo

_NAME = "camera folder"


class FolderCamera(StoredCamera):
    """Gives every stored multi-view once, in the order of its file names; keeps `Camera`.

    Numbers inside names sort as numbers: `img_2` comes before `img_10`. Patterns may reach into
    folders, so that the frames of a sweep are a camera too: `stop_*/sample_*/left.png`. One video
    per view is a camera as well; its pictures are taken in order. A picture that holds several
    views is read once and taken apart.

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
        self._like: dict[str, GreyImage] = {}
        self._regions: dict[tuple[str, int, int], dict[str, Region]] = {}

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": "folder", "model": "stored images", "serial": str(self._place)}

    def _open(self) -> None:
        self._multiviews = self._find()
        self._like = {}

    def _close(self) -> None:
        self._multiviews = []
        for video in self._videos.values():
            video.close()
        self._videos.clear()

    def _read(self, number: int) -> MultiView | None:
        if number >= len(self._multiviews):
            return None
        pictures = self._images(self._multiviews[number])
        read_s = self._clock.now_s()
        return MultiView(
            tuple(
                Frame(view, image, timestamp_s=read_s, sequence=number, colour=colour)
                for view, (image, colour) in zip(self._views, pictures, strict=True)
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

    def _images(self, stored: "Sequence[_Stored]") -> list[Picture]:
        whole = {one: self._picture(one) for one in dict.fromkeys(stored)}
        named = zip(self._views, stored, strict=True)
        pictures = [self._part(view, one, whole[one]) for view, one in named]
        for view, one, (image, _) in zip(self._views, stored, pictures, strict=True):
            self._check(view, one, image)
        return pictures

    def _part(self, view: str, stored: "_Stored", whole: Picture) -> Picture:
        if view not in self._config.parts:
            return whole
        source = self._config.files[view]
        image, colour = whole
        seen = (source, image.shape[0], image.shape[1])
        if seen not in self._regions:
            self._regions[seen] = self._regions_in(source, stored.path, image)
        region = self._regions[seen][view]
        return cut(image, region), None if colour is None else cut(colour, region)

    def _regions_in(self, source: str, path: Path, whole: GreyImage) -> dict[str, Region]:
        files, parts = self._config.files, self._config.parts
        own = {view: parts[view] for view in self._views if view in parts and files[view] == source}
        height_px, width_px = whole.shape
        try:
            return regions_in(own, (width_px, height_px))
        except ValueError as error:
            raise ConfigError(f"camera.{error}", advice=f"look at {path}") from error

    def _picture(self, stored: "_Stored") -> Picture:
        if stored.number is None:
            return read_picture(stored.path)
        return self._videos[stored.path].picture(stored.number)

    def _check(self, view: str, stored: "_Stored", image: GreyImage) -> None:
        first = self._like.setdefault(view, image)
        if image.shape != first.shape or image.dtype != first.dtype:
            raise DeviceLostError(
                _NAME,
                f"{stored.path} is {_size(image)}, the first image of view {view} is "
                f"{_size(first)}",
                advice="all images of a view must be alike",
            )
        depths = {one.dtype for one in self._like.values()}
        if len(depths) > 1:
            found = ", ".join(f"{name} {_size(one)}" for name, one in self._like.items())
            raise DeviceLostError(
                _NAME,
                f"views of {self._place} differ in depth: {found}",
                advice="views may differ in size, but not in bits: convert one of them",
            )


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
