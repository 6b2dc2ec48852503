"""Rendered pictures on disk, found again by what is on them.

Folder: `$RIG_CACHE_DIR`, else `$XDG_CACHE_HOME/epirig/renders`, else `~/.cache/epirig/renders`. It
may be deleted at any time. It stays below `LARGEST_BYTES`: the pictures unused for longest go.
"""

import logging
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]
Levels = NDArray[np.uint16]

LARGEST_BYTES = 2_000_000_000
_KEPT_AFTER_EVICTION = 0.8
_FULL_SCALE = 65535.0

_log = logging.getLogger(__name__)


def cache_folder() -> Path:
    """Return where pictures are kept; the folder need not exist."""
    chosen = os.environ.get("RIG_CACHE_DIR")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "epirig" / "renders"


class PictureCache:
    """Pictures of V views between 0 and 1, kept as one 16-bit PNG with the views in a column.

    A folder that cannot be written costs one warning and the speed, not the run.
    """

    def __init__(self, folder: Path, *, largest_bytes: int = LARGEST_BYTES) -> None:
        self._folder = folder
        self._largest_bytes = largest_bytes
        self._held_bytes: int | None = None
        self._writable = True

    def load(self, key: str, shapes: Sequence[tuple[int, int]]) -> tuple[Picture, ...] | None:
        """Return stored pictures (H, W), or None where there are none that are whole."""
        path = self._path(key)
        try:
            data = np.frombuffer(path.read_bytes(), np.uint8)
            os.utime(path)
        except OSError:
            return None
        tall, wide = sum(height for height, _ in shapes), max(width for _, width in shapes)
        column = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
        if column is None or column.dtype != np.uint16 or column.shape != (tall, wide):
            _log.warning("%s is broken; rendering it again", path)
            return None
        ends = np.cumsum([height for height, _ in shapes])[:-1]
        parts = np.split(column, ends)
        return tuple(
            _light(np.asarray(part[:, :width], np.uint16))
            for part, (_, width) in zip(parts, shapes, strict=True)
        )

    def store(self, key: str, pictures: Sequence[Picture]) -> tuple[Picture, ...]:
        """Keep pictures; return them as `load` would, rounded to 16 bit."""
        levels = [np.rint(picture * _FULL_SCALE).astype(np.uint16) for picture in pictures]
        if self._writable:
            wide = max(one.shape[1] for one in levels)
            padded = [np.pad(one, ((0, 0), (0, wide - one.shape[1]))) for one in levels]
            self._write(key, np.concatenate(padded))
        return tuple(map(_light, levels))

    def _write(self, key: str, column: Levels) -> None:
        coded = cv2.imencode(".png", column, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
        path = self._path(key)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Written aside and renamed: another process never sees half a picture.
            descriptor, aside = tempfile.mkstemp(dir=path.parent, suffix=".part")
            try:
                with os.fdopen(descriptor, "wb") as file:
                    file.write(coded)
                Path(aside).replace(path)
            except BaseException:
                Path(aside).unlink(missing_ok=True)
                raise
            self._make_room(len(coded))
        except OSError as error:
            self._writable = False
            _log.warning(
                "render cache %s cannot be written (%s); every run renders anew. "
                "Set RIG_CACHE_DIR to a folder of yours",
                self._folder,
                error.strerror or error,
            )

    def _make_room(self, added_bytes: int) -> None:
        if self._held_bytes is not None:
            self._held_bytes += added_bytes
            if self._held_bytes <= self._largest_bytes:
                return
        files = [(path, path.stat()) for path in self._folder.glob("*/*.png")]
        held_bytes = sum(stat.st_size for _, stat in files)
        if held_bytes > self._largest_bytes:
            for path, stat in sorted(files, key=lambda item: item[1].st_mtime):
                if held_bytes <= _KEPT_AFTER_EVICTION * self._largest_bytes:
                    break
                path.unlink(missing_ok=True)
                held_bytes -= stat.st_size
        self._held_bytes = held_bytes

    def _path(self, key: str) -> Path:
        return self._folder / key[:2] / f"{key}.png"


def _light(levels: Levels) -> Picture:
    return levels.astype(np.float32) / np.float32(_FULL_SCALE)
