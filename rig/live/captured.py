"""`rig.read_capture`: what `rig capture` wrote, as values again."""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.depth import read_pfm
from rig.errors import CalibrationError, FormatError, StoreError
from rig.files import read_bytes
from rig.frames import MultiView
from rig.geometry.pinhole import Pinhole
from rig.recording import recorded

FACTS = "frames.jsonl"
CAMERA = "camera.json"


@dataclass(frozen=True, eq=False)
class CapturedFrame:
    """One frame of a capture; maps are read from their files when they are asked for.

    A recording holds pictures and no maps: `views` is what it has. A folder holds maps and no
    pictures.
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
    def depth_mm(self) -> NDArray[np.float32]:
        """(H, W), NaN where there is no answer.

        Raises:
            StoreError: the capture has no depth (a recording, slopes only), or no such file.
        """
        if self.facts.get("sigma_unit") == "px per view step":
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
        if self.facts.get("sigma_unit") == "px per view step":
            raise StoreError(
                f"{self.source}: holds slopes only, asked for sigma in mm",
                advice="capture without --slopes-only",
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
    def label(self) -> NDArray[np.uint8]:
        """(H, W) labels; 0 where there is no answer.

        Of the depth as `DepthFrame.label` is; of the slopes in a capture of slopes only.

        Raises:
            StoreError: it is a recording, or there is no such file.
        """
        path = self._map("label", "png")
        encoded = np.frombuffer(read_bytes(path), np.uint8)
        label = cv2.imdecode(encoded, cv2.IMREAD_UNCHANGED) if encoded.size else None
        if label is None or label.ndim != 2 or label.dtype != np.uint8:
            raise StoreError(f"{path}: is no picture of labels", advice="capture again")
        found = np.array(label, np.uint8)
        if self.facts.get("sigma_unit") == "mm":
            found[np.isnan(self.depth_mm)] = 0
        return found

    @property
    def camera(self) -> Pinhole:
        """The pinhole camera that the maps are seen by.

        Raises:
            CalibrationError: the capture was made where nothing told the focal length.
        """
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

    def _map(self, kind: str, suffix: str) -> Path:
        if self.views is not None:
            raise StoreError(
                f"{self.source}: a recording holds pictures, asked for {kind}",
                advice='open its profile with overrides camera.kind="recording" and camera.file',
            )
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
