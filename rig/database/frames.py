"""Frame folders: one PNG per view, lossless, there completely or not at all.

    <frames>/<rig>/<sweep>_<UTC>/stop_003_0450.0mm_forward/sample_02/<view>.png

People find them by their names, and the `folder` camera replays them by the pattern
`stop_*/sample_*/<view>.png`.
"""

import hashlib
import os
import shutil
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from typing import cast
from uuid import uuid4

import cv2

from rig.database.scan_files import read_scan, write_scan
from rig.database.trouble import explained
from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.files import make_folder, sync_folder
from rig.frames import Frame, GreyImage, MultiView
from rig.pictures import PictureError, decoded
from rig.plan import Stop
from rig.records import StoredFrame

# Noisy pictures hardly shrink further: run lengths at the lowest level, after cheap filters, take
# a third of the time of the usual strategy and even less space.
_PNG = (
    *(cv2.IMWRITE_PNG_COMPRESSION, 1),
    *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE),
    *(cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FAST_FILTERS),
)


def sweep_folder(rig: str, sweep_id: int, started_at: datetime) -> Path:
    """Return the folder of a sweep below the frames' root."""
    return Path(rig) / f"{sweep_id}_{started_at:%Y%m%d-%H%M%S}"


def sample_folder(stop: Stop, number: int) -> Path:
    """Return the folder of a sample below its sweep's."""
    name = f"stop_{stop.index:03d}_{stop.distance_mm:06.1f}mm_{stop.direction}"
    return Path(name) / f"sample_{number:02d}"


class FrameWriter:
    """Writes the images of one sample beside their place, and puts them there in one step.

    A context manager: what was not published is gone at its end, so that a failure costs no space.

    Args:
        folder: of the sample.
        root: of the sweep or album, above it; is there. It is never made anew: what was
            unmounted would be written into the empty place where it was.
        modes: permission bits of what is made.
    """

    def __init__(self, folder: Path, root: Path, modes: FileModes) -> None:
        self._folder = folder
        self._root = root
        self._modes = modes
        self._beside = folder.with_name(f".{folder.name}.{uuid4().hex}.tmp")

    def __enter__(self) -> "FrameWriter":
        return self

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self._beside, ignore_errors=True)

    def write(self, multiview: MultiView) -> tuple[StoredFrame, ...]:
        """Write all images through to the disk, not yet at their place.

        Raises:
            StoreError: the disk is full, read-only or gone.
        """
        with explained("write frames", self._folder):
            if not self._root.is_dir():
                raise StoreError(
                    f"{self._root}: asked to write frames, the folder is gone (unmounted, deleted, "
                    "network share lost)",
                    advice="bring it back and go on with --resume; what was stored is in it",
                )
            make_folder(self._beside, self._modes.folder)
            with ThreadPoolExecutor(max_workers=min(4, len(multiview.frames))) as pool:
                stored = tuple(pool.map(self._write_one, multiview.frames))
            if multiview.scan is not None:
                write_scan(self._beside, multiview.scan, self._modes.file)
            sync_folder(self._beside)
        return stored

    def publish(self) -> None:
        """Put the folder at its place; one that no row of the database knows gives way.

        Raises:
            StoreError: the disk is full, read-only or gone.
        """
        with explained("write frames", self._folder):
            if self._folder.exists():
                shutil.rmtree(self._folder)
            self._beside.rename(self._folder)
            sync_folder(self._folder.parent)

    def _write_one(self, frame: Frame) -> StoredFrame:
        done, encoded = cv2.imencode(".png", frame.image, _PNG)
        if not done:
            raise StoreError(
                f"{self._folder}: view {frame.view} could not be turned into a PNG",
                advice="report it with the type and shape of the frame",
            )
        content = encoded.tobytes()
        path = self._beside / f"{frame.view}.png"
        with path.open("wb") as file:
            path.chmod(self._modes.file)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        return StoredFrame(
            view=frame.view,
            timestamp_s=frame.timestamp_s,
            sequence=frame.sequence,
            exposure_s=frame.exposure_s,
            sha256=hashlib.sha256(content).hexdigest(),
            bits=frame.bits,
            uncertainty_s=frame.uncertainty_s,
        )


def read_frames(
    folder: Path, frames: Sequence[StoredFrame], temperature_degc: float | None
) -> MultiView:
    """Read the images of a sample back, exactly as they were taken.

    Raises:
        StoreError: an image is missing, damaged, or another one than was stored.
    """
    read = tuple(_read_one(folder, frame) for frame in frames)
    return MultiView(read, temperature_degc, read_scan(folder))


def clear_unfinished(folder: Path) -> None:
    """Remove what killed programs left half-written below a sweep's folder.

    Raises:
        StoreError: the folder may not be written.
    """
    with explained("clear half-written frames", folder):
        for leftover in folder.glob("stop_*/.sample_*.tmp"):
            shutil.rmtree(leftover)


def _read_one(folder: Path, frame: StoredFrame) -> Frame:
    path = folder / f"{frame.view}.png"
    if not path.is_file():
        raise StoreError(
            f"{path}: asked for the image of view {frame.view}, it is missing",
            advice="bring the frames folder back, or point RIG_FRAMES to it",
        )
    with explained("read an image", path):
        content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != frame.sha256:
        raise StoreError(
            f"{path}: the image is damaged or was changed after it was stored "
            f"({len(content)} bytes, wrong SHA-256)",
            advice="bring it back from a copy",
        )
    return Frame(
        view=frame.view,
        image=_grey(path, content),
        timestamp_s=frame.timestamp_s,
        sequence=frame.sequence,
        exposure_s=frame.exposure_s,
        bits=frame.bits,
        uncertainty_s=frame.uncertainty_s,
    )


def _grey(path: Path, content: bytes) -> GreyImage:
    """Return the pixels of a stored image; its row may come from anywhere, also with its hash."""
    try:
        image = decoded(content)
    except PictureError as error:
        raise StoreError(
            f"{path}: the image {error}", advice="bring it back from a copy"
        ) from error
    if image.ndim != 2 or image.dtype.name not in ("uint8", "uint16"):
        raise StoreError(
            f"{path}: holds {image.shape} of {image.dtype}, stored images are grey of 8 or 16 bit",
            advice="bring it back from a copy",
        )
    return cast("GreyImage", image)
