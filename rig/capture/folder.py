"""The folder of one capture: maps per multi-view, a line of facts each, and a picture."""

import json
from collections.abc import Mapping
from pathlib import Path

from rig.capture.picture import write_picture
from rig.capture.virtual_depth import virtual_depth_of
from rig.depth import (
    write_bytes,
    write_depth_png,
    write_label_png,
    write_pfm,
    write_picture_png,
)
from rig.errors import StoreError
from rig.files import no_link, read_bytes
from rig.folder_lock import FolderLock
from rig.live.captured import CAMERA, FACTS, VIRTUAL_DEPTH
from rig.live.frame import DepthFrame
from rig.stored import Run

RUN = "run.json"
PICTURE = "last_frame.png"


class CaptureFolder:
    """Writes what a capture measures; every file appears whole or not at all.

    Args:
        folder: made where it is not there yet.
        run: of the rig that is captured.
        made: who captured it and with what, for `run.json`; None leaves that file out.
        resumes: whether it goes on with a scan, whose one multi-view may be there already.

    Raises:
        OwnedError: another program captures into it.
        StoreError: the folder holds another capture, or cannot be written.
    """

    name = "files"

    def __init__(
        self,
        folder: Path,
        run: Run,
        made: Mapping[str, object] | None = None,
        *,
        resumes: bool = False,
    ) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = FolderLock(folder)  # another capture into it would mix with this one
            try:
                require_free(folder, resumes=resumes)
                self._facts = open(folder / FACTS, "w", encoding="utf-8", opener=no_link)  # noqa: SIM115
            except BaseException:
                self._lock.release()
                raise
        except OSError as error:
            raise StoreError(
                f"capture folder {folder}: cannot be written: {error.strerror}",
                advice="choose another one with --out",
            ) from error
        if made is not None:
            content = json.dumps(made, indent=2, ensure_ascii=False)
            write_bytes(folder / RUN, f"{content}\n".encode())
        self._run = run
        self._virtual_depth = virtual_depth_of(run.profile)
        self._has_camera = False
        self._last: DepthFrame | None = None

    def write(self, frame: DepthFrame) -> None:
        """Write all maps of one multi-view and its line in `frames.jsonl`.

        Raises:
            StoreError: the folder cannot be written, e.g. the disk is full.
        """
        self._write_camera(frame)
        number = f"{frame.index:05d}"
        slopes = frame.slopes
        write_pfm(self.folder / f"slope_{number}.pfm", slopes.slope_px)
        if self._virtual_depth is not None:
            virtual = self._virtual_depth(slopes.slope_px)
            write_pfm(self.folder / f"{VIRTUAL_DEPTH}_{number}.pfm", virtual)
        write_label_png(self.folder / f"label_{number}.png", slopes.label)
        write_picture_png(self.folder / f"image_{number}.png", frame.image)
        if frame.colour is not None:
            write_picture_png(self.folder / f"colour_{number}.png", frame.colour)
        if frame.depth is None:
            write_pfm(self.folder / f"sigma_{number}.pfm", slopes.sigma_px)
        else:
            write_pfm(self.folder / f"sigma_{number}.pfm", frame.depth.sigma_mm)
            write_pfm(self.folder / f"depth_{number}.pfm", frame.depth.depth_mm)
            write_depth_png(self.folder / f"depth_{number}.png", frame.depth.depth_mm)
        try:
            self._facts.write(json.dumps(self._line(frame)) + "\n")
            self._facts.flush()
        except OSError as error:
            raise StoreError(
                f"{self._facts.name}: cannot be written: {error.strerror}",
                advice="make room and capture again, earlier maps are kept",
            ) from error
        self._last = frame

    def close(self) -> None:
        """Close the list of facts, and show the last multi-view in a picture.

        Raises:
            StoreError: the picture cannot be written.
        """
        self._facts.close()
        try:
            if self._last is not None:
                write_picture(self.folder / PICTURE, self._last, self._run.profile.reference)
        finally:
            self._lock.release()

    def _write_camera(self, measured: DepthFrame) -> None:
        if self._has_camera or measured.pinhole is None:
            return
        content = json.dumps(measured.pinhole.to_json(), indent=2)
        write_bytes(self.folder / CAMERA, content.encode())
        self._has_camera = True

    def _line(self, measured: DepthFrame) -> dict[str, object]:
        multiview = measured.views
        return {
            "frame": measured.index,
            "rig": self._run.profile.name,
            "curve": None if self._run.curve is None else self._run.curve.id,
            "curve_source": None if self._run.curve is None else self._run.curve.source,
            "calibration": self._run.optics.calibration_id,
            "sigma_unit": "px per view step" if measured.depth is None else "mm",
            "timestamp_s": multiview.timestamp_s,
            "time_ns": measured.time_ns,
            "skew_s": multiview.skew_s,
            "image_full_scale": multiview.frames[self._run.profile.reference].full_scale,
            "sequence": {frame.view: frame.sequence for frame in multiview.frames},
            "exposure_s": {frame.view: frame.exposure_s for frame in multiview.frames},
            "temperature_degc": multiview.temperature_degc,
            "latency_s": measured.latency_s,
            "measuring_s": measured.measuring_s,
            "processing": self._run.profile.processing.applied,
            "warnings": list(measured.slopes.warnings),
        }


def require_free(folder: Path, *, resumes: bool = False) -> None:
    """Refuse a folder in which multi-views are listed: maps of both would be taken for one capture.

    Args:
        folder: that a capture is to be written into.
        resumes: whether it goes on with a scan: one multi-view may be there, and is written again.

    Raises:
        StoreError: more are listed, or the list may not be read.
    """
    file = folder / FACTS
    if file.is_symlink() or not file.is_file():  # a link is refused when it is opened to write
        return
    count = len(read_bytes(file).splitlines())
    if count > (1 if resumes else 0):
        raise StoreError(
            f"asked to capture into {folder}, found a capture of {count} multi-views there "
            f"({FACTS})",
            advice="choose another folder with --out, or move that one; only a scan is gone on "
            "with, by --resume",
        )
