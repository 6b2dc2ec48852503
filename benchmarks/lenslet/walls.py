"""Slopes of painted walls through simulated lenslets: `python -m benchmarks.lenslet.walls`.

Walls square to the axis, painted with waves up to a share of a period per pixel of a view; truth
from closed form. `off` is the mean slope over the true one, `sigma` the robust spread of error over
sigma.
"""

import argparse
from collections.abc import Sequence

import numpy as np

from rig.epipolar import estimate_slopes
from tests.support.lenslet_wall import Box

_BOX = Box(1500, 1050)
_FINEST_PER_PX = (0.22, 0.35, 0.5)
_DISTANCES_MM = (350.0, 450.0, 560.0, 600.0, 640.0, 900.0)
_BORDER_PX = 15
_RANGE_PX = (-1.2, 1.8)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one line per wall."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="walls of each kind")
    asked = parser.parse_args(arguments)
    inner = np.s_[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
    for finest in _FINEST_PER_PX:
        for distance_mm in _DISTANCES_MM:
            true_px = _BOX.slope_px(distance_mm)
            errors, ratios = [], []
            for seed in range(1, asked.seeds + 1):
                views = _BOX.views(_BOX.wall(distance_mm, finest, seed), seed)
                found = estimate_slopes(views, _RANGE_PX)
                error = found.slope_px[inner] - true_px
                errors.append(error[np.isfinite(error)])
                in_sigmas = np.abs(error / found.sigma_px[inner])
                ratios.append(1.4826 * float(np.nanmedian(in_sigmas)))
            error = np.concatenate(errors)
            off_px = float(error.mean())
            off = "" if true_px == 0.0 else f" ({100.0 * off_px / true_px:+.2f} %)"
            print(
                f"waves to {finest:.2f} /px at {distance_mm:.0f} mm, slope {true_px:+.4f} px: "
                f"off by {off_px:+.5f} px{off}, rms {float(error.std()):.4f} px, "
                f"sigma {float(np.mean(ratios)):.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
