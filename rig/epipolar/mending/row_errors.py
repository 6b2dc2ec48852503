"""By how much each view lies across its epipolar lines, as a smooth field over its picture."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.smooth_field import SmoothField
from rig.epipolar.resample import Resampler

_PATCH_SIGMA_PX = 0.05


@dataclass(frozen=True)
class RowErrors:
    """By how much every picture lies across its lines; the reference has no error."""

    fields: tuple[SmoothField | None, ...]
    """Of each view, px across its line (`patches.directions`); None where its rows meet."""
    across: Float
    """(V, 2) unit vectors across the lines, right and down."""
    rms_px: Float
    """(V,) over the measured places, 0 where rows meet."""
    worst: tuple[str, ...]
    """Of each view, how far and where its error is largest, for people."""

    @classmethod
    def none(cls, views: int) -> "RowErrors":
        """Return those of views whose rows meet."""
        return cls((None,) * views, np.zeros((views, 2)), np.zeros(views), ("",) * views)

    @property
    def any(self) -> bool:
        """Whether there is anything to mend."""
        return any(one is not None for one in self.fields)

    @property
    def scatter_px(self) -> float:
        """What patches of the worst view are off by once mended, 1 sigma; 0 where rows meet.

        Without what every patch is off by.
        """
        worst = max((one.scatter for one in self.fields if one is not None), default=0.0)
        return max(worst**2 - _PATCH_SIGMA_PX**2, 0.0) ** 0.5

    def mended(self, images: NDArray[np.generic]) -> NDArray[np.generic]:
        """Bring pictures (V, H, W) onto their lines; as they are where all rows meet.

        Pictures keep their type, the border repeats.
        """
        bad = self._bad
        if not bad:
            return images
        mended = images.astype(np.float32)
        mended[bad] = self._resampler([images[i] for i in bad])
        return mended

    def warnings(self, x_steps: Float, y_steps: Float) -> tuple[str, ...]:
        """Say of every view whose rows do not meet how far they are apart, and where."""
        return tuple(
            f"rows: view {i} at ({x_steps[i]:g}, {y_steps[i]:g}) is {self.worst[i]} "
            f"({self.rms_px[i]:.2f} px rms); corrected here, calibrate the rig"
            for i in self._bad
        )

    def kept(self, kept: NDArray[np.bool_]) -> "RowErrors":
        """Return those of some of the views, (V,)."""
        chosen = np.flatnonzero(kept)
        return RowErrors(
            tuple(self.fields[i] for i in chosen),
            self.across[kept],
            self.rms_px[kept],
            tuple(self.worst[i] for i in chosen),
        )

    @property
    def _bad(self) -> list[int]:
        return [i for i, one in enumerate(self.fields) if one is not None]

    @cached_property
    def _resampler(self) -> Resampler:
        places: list[Float] = []
        shapes: list[tuple[int, int]] = []
        for one, across in zip(self.fields, self.across, strict=True):
            if one is not None:
                height, width = one.shape
                columns, rows = np.meshgrid(np.arange(width), np.arange(height))
                beside = one.everywhere().astype(np.float64)
                x = np.clip(columns + beside * across[0], 0, width - 1)
                y = np.clip(rows + beside * across[1], 0, height - 1)
                places.append(np.stack([x, y], axis=-1))
                shapes.append(one.shape)
        return Resampler(places, shapes)
