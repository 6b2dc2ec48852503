"""A stored video as pictures."""

from pathlib import Path

import cv2
import numpy as np

from rig.errors import DeviceLostError
from rig.frames import ColourImage, GreyImage

_NAME = "camera folder"

SUFFIXES = frozenset({".mp4", ".avi", ".mkv", ".mov", ".m4v", ".webm"})
"""Files that hold many pictures."""


class StoredVideo:
    """Pictures of one video file, counted from 0; closed with `close`.

    Raises:
        DeviceLostError: the file is no video, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture = cv2.VideoCapture(str(path))
        self._next = 0
        if not self._capture.isOpened() or len(self) <= 0:
            self._capture.release()
            raise DeviceLostError(
                _NAME, f"{path} is no video or is damaged", advice="replace or remove it"
            )

    def __len__(self) -> int:
        return int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))

    def picture(self, number: int) -> tuple[GreyImage, ColourImage | None]:
        """Return one picture in grey and in colour; reading in order is fast.

        Raises:
            DeviceLostError: the file ends before that picture.
        """
        if number != self._next:
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, number)
        there, picture = self._capture.read()
        if not there:
            raise DeviceLostError(
                _NAME,
                f"{self._path} asked for picture {number} of {len(self)}, it ends before",
                advice="the file is cut off: write it again",
            )
        self._next = number + 1
        if picture.ndim == 2:
            return np.asarray(picture, np.uint8), None
        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        return np.asarray(grey, np.uint8), np.ascontiguousarray(picture[..., ::-1], np.uint8)

    def close(self) -> None:
        """Let go of the file."""
        self._capture.release()
