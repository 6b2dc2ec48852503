"""What a 40-megapixel raw picture costs: `python -m benchmarks.lenslet`.

The array is that of a fit to a small synthetic white picture, continued over the large one.
"""

import math
import resource
import time
from dataclasses import replace

import numpy as np
from rig_sim.lenslets.array import TrueArray

from rig.lenslet.array import LensletArray, fit_array
from rig.lenslet.fit import lenslets_inside
from rig.lenslet.lattice import Lattice
from rig.lenslet.plan import plan_views
from rig.lenslet.views import sub_apertures
from rig.lenslet.white import RawFormat

SIZE_PX = (7728, 5368)
SPACING_PX = 14.3
OFFSETS_PX = np.array(
    [(0, 0), (-4, 0), (-2, 0), (2, 0), (4, 0), (0, -4), (0, -2), (0, 2), (0, 4)], np.float64
)


def large_array() -> LensletArray:
    """Return the array of a camera of 40 megapixels."""
    truth = TrueArray("hexagonal", 600, 420, SPACING_PX, 0.002, aperture_px=6.8)
    white = np.rint(800.0 * truth.white()).astype(np.uint16)
    small, _ = fit_array(white, RawFormat(1023, is_bayer=False, dark_levels=0.0), "hexagonal", 14.0)
    cos, sin = math.cos(0.002) * SPACING_PX, math.sin(0.002) * SPACING_PX
    middle_x, middle_y = (side / 2.0 for side in SIZE_PX)
    lattice = Lattice("hexagonal", (middle_x, cos, -sin), (middle_y, sin, cos), 1.0, 0.02, 0.001)
    i, j, _ = lenslets_inside(lattice, SIZE_PX, margin_px=0.6 * SPACING_PX)
    q = i + j // 2
    first = int(q.min()), int(j.min())
    gains = np.zeros((int(j.max()) - first[1] + 1, int(q.max()) - first[0] + 1))
    gains[j - first[1], q - first[0]] = 1.0
    vignetting = replace(small.vignetting, size_px=SIZE_PX)
    return replace(
        small,
        lattice=lattice,
        vignetting=vignetting,
        colour_gains=np.array([[1.3, 0.9], [0.9, 1.1]]),
        first=first,
        gains=gains,
    )


def main() -> None:
    """Print processor and wall time of plan and views, and the most memory."""
    array = large_array()
    raw = np.random.default_rng(1).integers(0, 1023, SIZE_PX[::-1], np.uint16)
    for name in ("first use (compiles)", "again"):
        began, used = time.perf_counter(), time.process_time()
        plan = plan_views(array, OFFSETS_PX)
        planned, planned_used = time.perf_counter(), time.process_time()
        views = sub_apertures(raw, array, plan)
        ended, ended_used = time.perf_counter(), time.process_time()
        print(
            f"{name}: plan {planned - began:.2f} s ({planned_used - used:.2f} s of processor), "
            f"nine views of {views.shape[2]} x {views.shape[1]} px {ended - planned:.2f} s "
            f"({ended_used - planned_used:.2f} s)"
        )
    most_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"most memory {most_gb:.2f} GB")


if __name__ == "__main__":
    main()
