"""One look at a target in the hand, for whoever shows it."""

import numpy as np

from rig.calibrate.coverage import Coverage
from rig.calibrate.pictures import Picture
from rig.calibrate.sight import PictureSightings
from rig.calibrate.watch import Look
from rig.errors import TargetError
from rig.targets import Detection
from tests.support.shown_frames import scene

SCENE = scene()


def look(number: int = 4) -> Look:
    """The target in all views but the second, in the upper left of the reference view so far."""
    multiview = SCENE.frame(0).views
    found = Detection(
        np.arange(2), np.array([[10.0, 20.0], [30.126, 20.5]]), np.full(2, 0.02), 0.9, 150.0
    )
    lost = TargetError("the board is cut off at the left", reason="clipped")
    count = len(multiview.frames)
    sizes = ((64, 40),) * count
    by_view = (found, lost, *[found] * (count - 2))
    cells = np.zeros((count, 4, 5), np.intp)
    cells[0, 0, 0] = 7
    coverage = Coverage(cells, np.eye(count, dtype=np.intp), np.zeros((0, 2)), np.zeros(0))
    return Look(
        SCENE.run.profile,
        Picture(number, multiview),
        PictureSightings(number, None, sizes, by_view),
        is_moving=True,
        kept=3,
        advice="bring it nearer, to about 400 mm",
        coverage=coverage,
        errors=((12, 1.5), (18, float("inf")), (24, 0.5)),
    )
