"""The public light field `antinous` with its true slopes, where it is present."""

from typing import Literal

import numpy as np

from benchmarks.slopes.dino import CENTRE, COLUMNS, read_pfm, read_view, shared_folder
from benchmarks.slopes.scenes import Scene
from rig.epipolar import RectifiedViews

Arms = Literal["cross", "row", "column"]
_RANGE_PX = -3.6, 3.2


def load_antinous(arms: Arms) -> Scene | None:
    """Row 4 and column 4, or one of them: (17 or 9 views); None where it is absent."""
    folder = shared_folder("hci-antinous")
    if folder is None:
        return None
    row = [(CENTRE, c) for c in range(COLUMNS)]
    column = [(r, CENTRE) for r in range(COLUMNS)]
    places = {"row": row, "column": column}.get(arms)
    if places is None:
        places = row + [place for place in column if place[0] != CENTRE]
    frames = np.stack(
        [read_view(folder / f"input_Cam{COLUMNS * r + c:03d}.png") for r, c in places]
    ).astype(np.uint8)
    steps = np.array(places, float) - CENTRE
    return Scene(
        f"hci-antinous, {arms}",
        RectifiedViews(frames, steps[:, 1], steps[:, 0], places.index((CENTRE, CENTRE))),
        read_pfm(folder / "gt_disp_lowres.pfm"),
        _RANGE_PX,
        border_px=15,
    )
