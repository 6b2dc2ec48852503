"""By how much each view lies across its epipolar lines, as a smooth field over its picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.smooth_field import SmoothField, grid_of
from rig.epipolar.resample import Resampler
from rig.errors import CurveError
from rig.json_codec import Codec

NOTICEABLE_PX = 0.05
"""Rows that meet to this are left as they are: so far measured places themselves are off."""
_THIRDS = (("top", "middle", "bottom"), ("left", "centre", "right"))


@dataclass(frozen=True)
class RowErrors:
    """By how much every picture lies across its lines; the reference has no error."""

    fields: tuple[SmoothField | None, ...]
    """Of each view, px across its line (`patches.directions`); None where nothing is known. It is
    taken out only where `rms_px` is above 0; else it tells how far the rows are known to meet."""
    across: Float
    """(V, 2) unit vectors across the lines, right and down."""
    rms_px: Float
    """(V,) over the measured places, 0 where rows meet."""
    worst: tuple[str, ...]
    """Of each view, how far and where its error is largest, for people."""
    per_slope: Float
    """(V,) px across per px of slope: cameras that stand off their places, known from a sweep. No
    error of the rows, and not taken out with them (`rig.epipolar.placement` finds it); 0 where
    unknown."""

    def __post_init__(self) -> None:
        views = len(self.fields)
        shapes = self.across.shape, self.rms_px.shape, self.per_slope.shape
        if shapes != ((views, 2), (views,), (views,)):
            raise ValueError(f"arrays of {shapes} for {views} views")
        if len(self.worst) != views:
            raise ValueError(f"{len(self.worst)} descriptions of {views} views")

    @classmethod
    def none(cls, views: int) -> "RowErrors":
        """Return those of views whose rows meet."""
        nothing = np.zeros(views)
        return cls((None,) * views, np.zeros((views, 2)), nothing, ("",) * views, nothing)

    @classmethod
    def of(
        cls,
        fields: tuple[SmoothField | None, ...],
        across: Float,
        places: Sequence[tuple[Float, Float]],
        per_slope: Float | None = None,
    ) -> "RowErrors":
        """Judge fields at places (x, y) in the picture of each view, px.

        Args:
            fields: of each view.
            across: (V, 2) unit vectors across the lines.
            places: of each view, two arrays (N,): where its field counts.
            per_slope: (V,); None where unknown.
        """
        judged = [
            _judged(field, direction, *where)
            for field, direction, where in zip(fields, across, places, strict=True)
        ]
        rms_px, worst = np.array([rms for rms, _ in judged]), tuple(said for _, said in judged)
        none = np.zeros(len(fields))
        return cls(fields, across, rms_px, worst, none if per_slope is None else per_slope)

    @property
    def any(self) -> bool:
        """Whether there is anything to mend."""
        return bool(self._bad)

    @property
    def scatter_px(self) -> float:
        """What patches of the worst view are off by once mended, 1 sigma; 0 where rows meet.

        Without what every patch is off by.
        """
        fields = [self.fields[i] for i in self._bad]
        worst = max((one.scatter for one in fields if one is not None), default=0.0)
        return max(worst**2 - NOTICEABLE_PX**2, 0.0) ** 0.5

    def plus(self, left: "RowErrors") -> "RowErrors":
        """Return these with what is left once they are taken out.

        Args:
            left: of the same views.
        """
        if not left.any:
            return self
        fields = tuple(
            first
            if rms == 0.0 or second is None
            else second.on_top_of(first if was > 0.0 else None)
            for first, second, was, rms in zip(
                self.fields, left.fields, self.rms_px, left.rms_px, strict=True
            )
        )
        nowhere: tuple[Float, Float] = np.zeros(0), np.zeros(0)
        places: list[tuple[Float, Float]] = [
            nowhere if one is None else grid_of(one.shape) for one in fields
        ]
        is_known = np.not_equal(self.across, 0.0).any(axis=1, keepdims=True)
        across = np.where(is_known, self.across, left.across)
        joined = RowErrors.of(fields, across, places)
        moved = (left.rms_px > 0.0).tolist()
        worst = zip(moved, joined.worst, self.worst, strict=True)
        return RowErrors(
            fields,
            across,
            np.where(left.rms_px > 0.0, joined.rms_px, self.rms_px),
            tuple(now if has_moved else before for has_moved, now, before in worst),
            self.per_slope,
        )

    def lines(self, names: Sequence[str]) -> tuple[str, ...]:
        """Say of every view, by its name, whose rows do not meet how far and where."""
        return tuple(f"rows: {names[i]} is {self.worst[i]}; calibrate" for i in self._bad)

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
            self.per_slope[kept],
        )

    @property
    def _bad(self) -> list[int]:
        return np.flatnonzero(self.rms_px).tolist()

    @cached_property
    def _resampler(self) -> Resampler:
        places: list[Float] = []
        shapes: list[tuple[int, int]] = []
        for i in self._bad:
            one, across = self.fields[i], self.across[i]
            if one is not None:
                height, width = one.shape
                columns, rows = np.meshgrid(np.arange(width), np.arange(height))
                beside = one.everywhere().astype(np.float64)
                x = np.clip(columns + beside * across[0], 0, width - 1)
                y = np.clip(rows + beside * across[1], 0, height - 1)
                places.append(np.stack([x, y], axis=-1))
                shapes.append(one.shape)
        return Resampler(places, shapes)


def _judged(
    field: SmoothField | None, across: Float, x_px: Float, y_px: Float
) -> tuple[float, str]:
    """Rms of a field and where it is largest; 0 and nothing where rows meet."""
    if field is None or not len(x_px):
        return 0.0, ""
    values = field.at(x_px, y_px)
    # What is well measured, not where the polynomial runs out.
    sure = field.sigma_at(x_px, y_px) < np.maximum(0.5 * np.abs(values), NOTICEABLE_PX)
    rms_px = float(np.sqrt(np.mean(values[sure] ** 2))) if sure.any() else 0.0
    if rms_px < NOTICEABLE_PX:
        return 0.0, ""
    k = int(np.argmax(np.where(sure, np.abs(values), 0.0)))
    right, down = float(values[k]) * across
    if abs(down) >= abs(right):
        way = "low" if down > 0 else "high"
    else:
        way = "too far right" if right > 0 else "too far left"
    row = _THIRDS[0][min(max(int(3 * y_px[k] / field.shape[0]), 0), 2)]
    column = _THIRDS[1][min(max(int(3 * x_px[k] / field.shape[1]), 0), 2)]
    return rms_px, f"{abs(float(values[k])):.1f} px {way} at the {row} {column}"


ROW_ERRORS_JSON = Codec(
    RowErrors, name="mending of rows", error=CurveError, advice="run rig fit on its sweep"
)
"""As it is stored with a curve."""
