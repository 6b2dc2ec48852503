"""`rig.read_capture`: what `rig capture` wrote, as values again."""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.depth import read_pfm
from rig.errors import CalibrationError, FormatError, StoreError
from rig.files import read_bytes
from rig.frames import GreyImage, MultiView
from rig.geometry.pinhole import Pinhole
from rig.pictures import PictureError, decoded
from rig.recording import recorded

FACTS = "frames.jsonl"
CAMERA = "camera.json"
VIRTUAL_DEPTH = "virtual_depth"


@dataclass(frozen=True, eq=False)
class CapturedFrame:
    """One frame of a capture; maps are read from their files when they are asked for.

    A recording holds pictures and no maps: `views` is what it has. A folder holds maps and the
    picture of the reference view.
    """

    index: int
    """Number of the frame in the capture, from 0."""
    timestamp_s: float
    """Middle of the exposure on the clock of the camera's host."""
    time_ns: int | None
    """The same by the wall clock, UTC; None in captures of old, which hold none."""
    views: MultiView | None
    """The pictures; None for a folder."""
    facts: dict[str, Any]
    """Its line of `frames.jsonl`; empty for a recording."""
    source: Path
    """Folder or recording."""
    pinhole: Pinhole | None = None
    """See `camera`."""

    @property
    def has_depth(self) -> bool:
        """Whether it was captured with a curve; False for a recording."""
        return self.views is None and not self._has_slopes_only

    @property
    def depth_mm(self) -> NDArray[np.float32]:
        """(H, W), NaN where there is no answer.

        Raises:
            StoreError: the capture has no depth (a recording, slopes only), or no such file.
        """
        if self._has_slopes_only:
            raise StoreError(
                f"{self.source}: holds slopes only, asked for depth",
                advice="capture without --slopes-only",
            )
        return read_pfm(self._map("depth", "pfm"))

    @property
    def sigma_mm(self) -> NDArray[np.float32]:
        """(H, W) 1 sigma of the depth.

        Raises:
            StoreError: see `depth_mm`.
        """
        if self._has_slopes_only:
            raise StoreError(
                f"{self.source}: holds slopes only, asked for sigma in mm",
                advice="capture without --slopes-only",
            )
        return read_pfm(self._map("sigma", "pfm"))

    @property
    def sigma_px(self) -> NDArray[np.float32]:
        """(H, W) 1 sigma of the slope, px per view step, of a capture of slopes only.

        Raises:
            StoreError: it was captured with a curve, is a recording, or there is no such file.
        """
        if self.has_depth:
            raise StoreError(
                f"{self.source}: holds the sigma of the depth, asked for that of the slope",
                advice="read sigma_mm, or capture with --slopes-only",
            )
        return read_pfm(self._map("sigma", "pfm"))

    @property
    def slope_px(self) -> NDArray[np.float32]:
        """(H, W) slopes, px per view step.

        Raises:
            StoreError: it is a recording, or there is no such file.
        """
        return read_pfm(self._map("slope", "pfm"))

    @property
    def virtual_depth(self) -> NDArray[np.float32] | None:
        """(H, W) distance of the image behind the main lens from the lenslets.

        In units of the lenslets' distance from the sensor: 0 at the focus distance, positive where
        the slope is, NaN where there is none. None where no lenslet camera gave the frame.

        Raises:
            StoreError: it is a recording, or the file is no map.
        """
        path = self._map(VIRTUAL_DEPTH, "pfm")
        return read_pfm(path) if path.is_file() else None

    @property
    def label(self) -> NDArray[np.uint8]:
        """(H, W) labels; 0 where there is no answer.

        Of the depth as `DepthFrame.label` is; of the slopes in a capture of slopes only.

        Raises:
            StoreError: it is a recording, or there is no such file.
        """
        path = self._map("label", "png")
        label = _decoded(path, "picture of labels")
        if label.ndim != 2 or label.dtype != np.uint8:
            raise StoreError(f"{path}: is no picture of labels", advice="capture again")
        found = np.array(label, np.uint8)
        if self.facts.get("sigma_unit") == "mm":
            found[np.isnan(self.depth_mm)] = 0
        return found

    @property
    def image(self) -> GreyImage | None:
        """(H, W) grey values of the reference view at the pixels of the maps.

        None where the capture was written before pictures were kept.

        Raises:
            StoreError: it is a recording, which has `views`, or the file is no picture.
        """
        path = self._map("image", "png")
        if not path.is_file():
            return None
        image = _decoded(path, "grey picture")
        if image.ndim != 2 or str(image.dtype) not in ("uint8", "uint16"):
            raise StoreError(f"{path}: is no grey picture", advice="capture again")
        return cast("GreyImage", image)

    @property
    def colour(self) -> NDArray[np.uint8] | None:
        """(H, W, 3) red, green and blue at the pixels of the maps, of `colour_NNNNN.png`.

        None where there is no such file: the camera gave no colour.

        Raises:
            StoreError: it is a recording, or the file is no picture in colour.
        """
        path = self._map("colour", "png")
        if not path.is_file():
            return None
        image = _decoded(path, "8-bit picture in colour")
        if image.shape[2:] != (3,) or image.dtype != np.uint8:
            raise StoreError(f"{path}: is no 8-bit picture in colour", advice="capture again")
        return np.ascontiguousarray(image[..., ::-1], np.uint8)

    @property
    def camera(self) -> Pinhole:
        """The pinhole camera that the maps are seen by.

        Raises:
            CalibrationError: the capture was made where nothing told the focal length.
            StoreError: it is a recording.
        """
        self._require_maps("the camera of its maps")
        if self.pinhole is None:
            raise CalibrationError(
                f"{self.source}: has no {CAMERA}, asked for the camera of its maps",
                advice=f"run `rig calibrate {self.facts.get('rig', 'PROFILE')}`, capture again",
            )
        return self.pinhole

    def points_mm(self) -> Float:
        """(H, W, 3) points in the reference camera's frame; see `DepthFrame.points_mm`.

        Raises:
            CalibrationError: the focal length was not known.
            StoreError: the capture has no depth.
        """
        return self.camera.points_mm(self.depth_mm)

    @property
    def _has_slopes_only(self) -> bool:
        return self.facts.get("sigma_unit") == "px per view step"

    def _require_maps(self, asked: str) -> None:
        if self.views is not None:
            raise StoreError(
                f"{self.source}: a recording holds pictures, asked for {asked}",
                advice="measure it: rig capture PROFILE --set camera.kind=recording "
                f"--set camera.file={self.source} --out FOLDER; a program opens the profile with "
                "these as overrides",
            )

    def _map(self, kind: str, suffix: str) -> Path:
        self._require_maps(kind)
        return self.source / f"{kind}_{self.index:05d}.{suffix}"


def read_capture(source: str | os.PathLike[str]) -> Iterator[CapturedFrame]:
    """Yield the frames that `rig capture` wrote, in order.

    Args:
        source: folder of `rig capture --out`, or MCAP file of `rig capture --record`.

    Raises:
        FormatError: a line of `frames.jsonl` or `camera.json` is damaged.
        StoreError: there is no such capture, or it cannot be read.
    """
    path = Path(source)
    if path.is_dir():
        return _of_folder(path, read_bytes(path / FACTS), _pinhole(path / CAMERA))
    if not path.is_file():
        raise StoreError(
            f"{path}: no such capture", advice="give the folder of --out or the file of --record"
        )
    return _of_recording(path)


def _of_folder(folder: Path, facts: bytes, pinhole: Pinhole | None) -> Iterator[CapturedFrame]:
    for number, line in enumerate(facts.splitlines(), start=1):
        try:
            told = cast("dict[str, Any]", json.loads(line))
            time_ns = told.get("time_ns")
            yield CapturedFrame(
                index=int(told["frame"]),
                timestamp_s=float(told["timestamp_s"]),
                time_ns=None if time_ns is None else int(time_ns),
                views=None,
                facts=told,
                source=folder,
                pinhole=pinhole,
            )
        except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
            raise FormatError(
                f"{folder / FACTS}: line {number} is damaged: {error!r}",
                advice="capture again, or remove this line",
            ) from error


def _decoded(path: Path, wanted: str) -> NDArray[np.generic]:
    """Return the pixels of a picture as OpenCV orders them; `wanted` is what it is to be."""
    try:
        return decoded(read_bytes(path))
    except PictureError as error:
        raise StoreError(f"{path}: is no {wanted}: it {error}", advice="capture again") from error


def _pinhole(path: Path) -> Pinhole | None:
    if not path.is_file():
        return None
    try:
        return Pinhole.from_json(json.loads(read_bytes(path)))
    except (FormatError, ValueError) as error:
        raise FormatError(f"{path}: {error}", advice="capture again") from error


def _of_recording(path: Path) -> Iterator[CapturedFrame]:
    for index, found in enumerate(recorded(path)):
        taken_s = found.views.timestamp_s
        yield CapturedFrame(index, taken_s, found.time_ns, found.views, {}, path)
