"""Parts of a picture."""

from dataclasses import dataclass

import numpy as np

from rig_sim.board import Board
from rig_sim.optics import TrueCamera

_BORDER_PX = 2
_POINTS_PER_SIDE = 16


@dataclass(frozen=True, slots=True)
class Window:
    """Columns x0 to x1 and rows y0 to y1 of a picture, the ends left out."""

    x0: int
    y0: int
    x1: int
    y1: int

    @classmethod
    def whole(cls, camera: TrueCamera) -> "Window":
        """Return the window of the whole picture."""
        return cls(0, 0, camera.width_px, camera.height_px)

    @classmethod
    def of_board(cls, camera: TrueCamera, board: Board) -> "Window":
        """Return the part of the picture that can show the board, empty if none can."""
        outline_px = camera.pixels(board.in_world_mm(board.outline_mm(_POINTS_PER_SIDE)))
        size_px = np.array([camera.width_px, camera.height_px])
        low = np.clip(np.floor(outline_px.min(axis=0)).astype(int) - _BORDER_PX, 0, size_px)
        high = np.clip(np.ceil(outline_px.max(axis=0)).astype(int) + _BORDER_PX + 1, 0, size_px)
        return cls(int(low[0]), int(low[1]), int(high[0]), int(high[1]))

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        """Number of rows."""
        return self.y1 - self.y0

    @property
    def is_empty(self) -> bool:
        """Whether nothing is inside."""
        return self.width <= 0 or self.height <= 0

    @property
    def pixels(self) -> tuple[slice, slice]:
        """Rows and columns, to index a picture (H, W)."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)
