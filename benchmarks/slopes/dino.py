"""The public light field `dino` with the full cross-hair of views, where it is present."""

import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import Scene
from rig.epipolar import RectifiedViews

COLUMNS, CENTRE = 9, 4
"""A full light field has 9 x 9 views, file index = 9 * row + column."""


def shared_folder(name: str) -> Path | None:
    """A folder of the shared data (`RIG_SHARED_DATA`), or None where it is absent."""
    root = Path(__file__).parents[2]
    shared = Path(os.environ.get("RIG_SHARED_DATA", root.parent / "shared" / "data"))
    folder = shared / name
    return folder if folder.is_dir() else None


def dino_folder() -> Path | None:
    """Folder `hci-dino` of the shared data, or None."""
    return shared_folder("hci-dino")


def load_dino(folder: Path, noise: float, *, in_colour: bool = False) -> Scene:
    """All 17 views of row 4 and column 4; `noise` grey levels (1 sigma) are added."""
    places = [(CENTRE, c) for c in range(COLUMNS)]
    places += [(r, CENTRE) for r in range(COLUMNS) if r != CENTRE]
    names = [folder / f"input_Cam{COLUMNS * r + c:03d}.png" for r, c in places]
    images = np.stack([read_view(name, in_colour=in_colour) for name in names])
    clean = images.astype(np.float32)
    images += noise * np.random.default_rng(1).standard_normal(images.shape)
    frames = np.clip(np.rint(images), 0, 255).astype(np.uint8)
    steps = np.array(places, float) - CENTRE
    views = RectifiedViews(frames, steps[:, 1], steps[:, 0], CENTRE)
    reference = read_pfm(folder / "reference_subfocal.pfm")
    return Scene(
        f"hci-dino, noise {noise:g}",
        views,
        reference,
        (-2.0, 2.0),
        border_px=15,
        noise_levels=noise,
        clean=None if in_colour else clean,
        half="C",
    )


def read_view(path: Path, *, in_colour: bool = False) -> NDArray[np.float64]:
    """Grey (H, W) or colour (H, W, 3) values of a picture."""
    flags = cv2.IMREAD_COLOR_RGB if in_colour else cv2.IMREAD_GRAYSCALE
    image = cv2.imread(str(path), flags)
    if image is None:
        raise OSError(f"cannot read {path}")
    return image.astype(np.float64)


def read_pfm(path: Path) -> NDArray[np.float64]:
    """One channel (H, W) of a portable float map, the top row first."""
    with path.open("rb") as file:
        file.readline()
        width, height = (int(n) for n in file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        rows = np.frombuffer(file.read(), order).reshape(height, width)
    return rows[::-1].astype(np.float64)
