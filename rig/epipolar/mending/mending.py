"""What was found wrong with the pictures of a rig: rows that miss, light that differs, noise.

It belongs to the cameras, not to the scene, so the next multi-view is mended by it from the start.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.light import LightField
from rig.epipolar.mending.row_drift import RowDrift
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.noise.model import CrossNoise

_NOTICEABLE_LEVELS = 2.0
"""Light that is named; less is taken out without a word."""


@dataclass(frozen=True, slots=True)
class Mending:
    """What makes the views of one rig fit each other."""

    rows: RowErrors
    light: tuple[tuple[LightField | None, ...], ...]
    """Of every channel (one in grey) and view."""
    noise: CrossNoise | None = None
    """What the views differ by once they fit; None where it was not measured."""
    drift: RowDrift | None = None
    """What of the rows was not expected; None where they were taken as known, or not looked at."""

    def kept(self, kept: NDArray[np.bool_]) -> "Mending":
        """Return that of some of the views, (V,)."""
        chosen = np.flatnonzero(kept)
        return Mending(
            self.rows.kept(kept),
            tuple(tuple(channel[i] for i in chosen) for channel in self.light),
            self.noise,
            None if self.drift is None else self.drift.kept(kept),
        )

    def warnings(self, x_steps: Float, y_steps: Float) -> tuple[str, ...]:
        """Say of every view what was mended, where it is more than a trifle."""
        said = list(self.rows.warnings(x_steps, y_steps))
        for i in range(len(x_steps)):
            fields = [field for channel in self.light if (field := channel[i]) is not None]
            levels = max((field.rms_levels for field in fields), default=0.0)
            if levels > _NOTICEABLE_LEVELS:
                said.append(
                    f"light: view {i} at ({x_steps[i]:g}, {y_steps[i]:g}) differs from the "
                    f"reference by {levels:.1f} levels rms over the picture; corrected here, look "
                    "at its lens, exposure and lamps"
                )
        return tuple(said)
