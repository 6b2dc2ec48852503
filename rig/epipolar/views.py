"""What goes into the slope estimator and what comes out."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.placement.placement import Placement
from rig.epipolar.steady import Steady
from rig.errors import SlopeError

Image = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

_SMALLEST_PX = 2


class Label(IntEnum):
    """What is known about a pixel's slope."""

    NONE = 0
    """No answer; the slope is NaN."""
    NEARER = 1
    """Nearer than the focus distance (slope above 0)."""
    BEYOND = 2
    """Beyond the focus distance (slope of 0 or below)."""
    OCCLUSION = 3
    """At an occlusion boundary: visible in some of the views only."""
    FILLED = 4
    """Not measured: a hole that was bridged, only where filling was asked for."""


@dataclass(frozen=True, slots=True)
class RectifiedViews:
    """V views of one instant, grey or in colour, rectified to one common frame.

    A point at `(u, v)` in the reference view with slope `m` appears at
    `(u - m * x_steps[i], v - m * y_steps[i])` in view i.
    """

    images: Image
    """(V, H, W) grey or (V, H, W, 3) in colour, all of one type: uint8, uint16 or float32. Boards
    and the methods that `rig compare` sets beside ours take grey only."""
    x_steps: NDArray[np.float64]
    """(V,) columns of the views, in view steps, right of the reference is positive."""
    y_steps: NDArray[np.float64]
    """(V,) rows of the views, in view steps, below the reference is positive."""
    reference: int
    """Index of the view at (0, 0)."""
    noise: NoiseModel | None = None
    """Noise of the grey values of the reference camera, as measured; None for what the images show
    themselves. Resampled pictures need it: resampling takes the fine part of the noise away, by
    which it is told, and leaves the rest."""
    beside_px: Float | None = None
    """(V, 2) by how much each picture is known to lie right of and below its lines; None for none:
    rectified pictures lie on them."""
    mending: Mending | None = None
    """What the last multi-view of these cameras showed to be wrong with their pictures
    (`SlopeMap.mending`), to be taken out of these too; None to look for it."""
    row_errors: RowErrors | None = None
    """What the rows of these cameras missed by when their curve was made: taken out where no later
    mending is known, and what is left is looked for; None where nothing is known."""

    def __post_init__(self) -> None:
        shapes = {np.shape(image) for image in self.images}
        if len(shapes) > 1:
            found = ", ".join(" x ".join(map(str, shape)) for shape in sorted(shapes))
            raise SlopeError(
                f"views of different size given ({found}, rows first)",
                advice="rectify them to one frame",
            )
        images = np.asarray(self.images)
        is_grey_or_colour = images.ndim == 3 or (images.ndim == 4 and images.shape[3] == 3)
        if not is_grey_or_colour or str(images.dtype) not in ("uint8", "uint16", "float32"):
            raise SlopeError(
                f"asked for slopes of an array {images.shape} of {images.dtype}",
                advice="give (V, H, W) "
                "grey or (V, H, W, 3) colour images of uint8, uint16 or float32",
            )
        if min(images.shape[1:3]) < _SMALLEST_PX:
            raise SlopeError(
                f"asked for slopes of pictures of {images.shape[2]} x {images.shape[1]} px",
                advice=f"give {_SMALLEST_PX} px or more on either side",
            )
        count = images.shape[0]
        x = np.ascontiguousarray(self.x_steps, np.float64)
        y = np.ascontiguousarray(self.y_steps, np.float64)
        if count < 2 or x.shape != (count,) or y.shape != (count,):
            raise SlopeError(
                f"found {count} views with {x.size} x and {y.size} y positions",
                advice="give two views or more and one position for each",
            )
        if not 0 <= self.reference < count:
            raise SlopeError(
                f"reference view {self.reference} asked for, views are 0..{count - 1}",
                advice="name one of them",
            )
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            raise SlopeError(
                "view positions that are not finite given",
                advice="give finite numbers of view steps",
            )
        if abs(x[self.reference]) > 1e-9 or abs(y[self.reference]) > 1e-9:
            raise SlopeError(
                f"the reference view lies at ({x[self.reference]}, {y[self.reference]}) view steps",
                advice="positions are counted from it, so it must be at (0, 0)",
            )
        if self.beside_px is not None and (
            self.beside_px.shape != (count, 2) or not np.isfinite(self.beside_px).all()
        ):
            raise SlopeError(
                f"found displacements {self.beside_px.shape} of {count} pictures",
                advice="give two finite numbers of px for each",
            )
        if float(np.hypot(x, y).max()) < 1e-6:
            raise SlopeError("all views lie at one position", advice="slopes need a baseline")
        object.__setattr__(self, "images", np.ascontiguousarray(images))
        object.__setattr__(self, "x_steps", x)
        object.__setattr__(self, "y_steps", y)

    @property
    def is_colour(self) -> bool:
        """Whether every pixel has three channels."""
        return self.images.ndim == 4

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of every view, px."""
        return self.images.shape[1], self.images.shape[2]

    def places_px(self, view: int, pixels: Float, slope_px: Float, beside_px: Float) -> Float:
        """Where the line of reference pixels passes through the picture of a view.

        Args:
            view: index.
            pixels: (2, N) in the reference view.
            slope_px: (N,) px per view step.
            beside_px: (2, N) by how much the picture lies beside the lines.

        Returns:
            (2, N) pixels of that picture.
        """
        step = np.array([self.x_steps[view], self.y_steps[view]])[:, None]
        known_px = 0.0 if self.beside_px is None else self.beside_px[view][:, None]
        return pixels - slope_px * step + beside_px + known_px

    def common_px(self, xy_px: Mapping[int, Float]) -> dict[int, Float]:
        """Points (..., 2) of pictures, by view, in the common frame: for these views, the same."""
        return dict(xy_px)

    def placed(self, placement: Placement) -> "RectifiedViews":
        """Return these views at the places that were found, for the next estimate."""
        known_px = 0.0 if self.beside_px is None else self.beside_px
        return replace(
            self,
            x_steps=self.x_steps + placement.steps[:, 0],
            y_steps=self.y_steps + placement.steps[:, 1],
            beside_px=known_px + placement.beside_px,
        )


@dataclass(frozen=True, slots=True)
class SlopePrior:
    """A slope hypothesis N(m, sigma^2) for every pixel of the reference view."""

    slope_px: NDArray[np.float32]
    """(H, W), px per view step; NaN where there is none."""
    sigma_px: NDArray[np.float32]
    """(H, W), 1 sigma."""
    steady: Steady | None = None
    """What else the last multi-view of these cameras told (`SlopeMap.steady`); None to measure all
    of it anew."""


@dataclass(frozen=True, slots=True)
class SlopeMap:
    """Slope, its standard deviation and a label for every pixel of the reference view."""

    slope_px: NDArray[np.float32]
    """(H, W), px per view step, NaN only where the label is 0."""
    sigma_px: NDArray[np.float32]
    """(H, W), 1 sigma; `|error| / sigma` has a robust standard deviation near 1."""
    label: NDArray[np.uint8]
    """(H, W), values of `Label`."""
    warnings: tuple[str, ...] = field(default=())
    """What was left out and why, e.g. a view that is black."""
    placement: Placement | None = None
    """Errors of the places that views were told to have, taken out of the slopes; None where no
    error is sure, or none was looked for (around a hypothesis)."""
    mending: Mending | None = None
    """Errors of rows and light that were taken out, for the next multi-view of the same cameras."""
    steady: Steady | None = None
    """What hardly changes, for the next multi-view if these slopes are its hypothesis; None in
    colour."""
