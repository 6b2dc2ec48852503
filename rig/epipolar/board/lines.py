"""The lines of a board's edge pixels through pictures, whatever frame the pictures are in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.board.misalignment import Misalignment
from rig.epipolar.spline import sample_lines
from rig.errors import SlopeError

_MIN_ENERGY = 0.02
"""Squared gradient, of the strongest edges, below which a pixel tells nothing about slope."""


class BoardViews(Protocol):
    """Pictures and the way of the epipolar lines through them: `RectifiedViews` and the like."""

    @property
    def images(self) -> Sequence[NDArray[np.generic]] | NDArray[np.generic]:
        """(H, W) per view; they may differ in size."""
        ...

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the common frame."""
        ...

    @property
    def x_steps(self) -> Float:
        """(V,) view positions."""
        ...

    @property
    def y_steps(self) -> Float:
        """(V,)."""
        ...

    @property
    def reference(self) -> int:
        """Index of the view at (0, 0)."""
        ...

    def places_px(self, view: int, pixels: Float, slope_px: Float, beside_px: Float) -> Float:
        """Where the lines of reference pixels pass through a picture."""
        ...

    def common_px(self, xy_px: Mapping[int, Float]) -> dict[int, Float]:
        """Points of pictures in the common frame."""
        ...


@dataclass(frozen=True, slots=True)
class Paths:
    """Where the lines of some pixels pass through the pictures, for slopes near a plane."""

    pixels: Float
    """(2, N) of the reference view."""
    plane: Float
    """(3,) slope plane at which `places_px` holds."""
    places_px: Float
    """(V, 2, N)."""
    rates: Float
    """(V, 2, N) change of the places per px of slope."""
    turns: Float
    """(V, 2, 2) change of a picture's pixels by those of the common frame, at the board's centre.

    They weigh the gradients of the views, which a per cent more or less does not change."""

    def only(self, mask: NDArray[np.bool_]) -> "Paths":
        """Return the paths of some of the pixels."""
        return replace(
            self,
            pixels=np.ascontiguousarray(self.pixels[:, mask]),
            places_px=np.ascontiguousarray(self.places_px[:, :, mask]),
            rates=np.ascontiguousarray(self.rates[:, :, mask]),
        )


@dataclass(frozen=True, slots=True)
class BoardLines:
    """The views as splines; lines through them follow a slope plane about the centre."""

    views: BoardViews
    used: list[int]
    coefficients: NDArray[np.float32]
    """(V, H, W), where pictures end before the largest filled up with their last pixels."""
    centre_px: Float
    misalignment: Misalignment

    def design(self, pixels: Float) -> Float:
        """(3, N) derivatives of the slope by a, b, c."""
        return np.stack([np.ones(pixels.shape[1]), *(pixels - self.centre_px[:, None])])

    def paths(self, pixels: Float, plane: Float) -> Paths:
        """Follow the lines through all views; they bend so little that rates suffice."""
        slope = plane @ self.design(pixels)
        low, high = (self._places(pixels, slope + half) for half in (-0.5, 0.5))
        return Paths(pixels, plane, self._places(pixels, slope), high - low, self._turns(plane[:1]))

    def sample(self, paths: Paths, plane: Float) -> tuple[Float, Float]:
        """Values (V, N) along the lines and their mean gradient (2, N)."""
        change = (plane - paths.plane) @ self.design(paths.pixels)
        return sample_lines(self.coefficients, paths.places_px, paths.rates, change, paths.turns)

    def steps(self) -> Float:
        """(V, 2) view positions about their mean."""
        steps = np.stack([self.views.x_steps, self.views.y_steps], axis=-1)[self.used]
        return steps - steps.mean(axis=0)

    def edges(self, outline_px: Float, plane: Float, reference: int) -> Paths:
        """Follow the pixels of the reference view on edges of the board that all views see."""
        inside = np.zeros(self.views.shape, np.uint8)
        cv2.fillConvexPoly(inside, np.round(outline_px).astype(np.int32), 1)
        row, column = np.nonzero(inside)
        pixels = np.stack([column, row]).astype(np.float64)
        slope = plane @ self.design(pixels)
        places = self._places(pixels, slope, [reference])
        seen = self._inside(places, [reference])
        pixels, places = pixels[:, seen], np.ascontiguousarray(places[:, :, seen])
        _, gradient = sample_lines(
            self.coefficients[reference : reference + 1],
            places,
            np.zeros_like(places),
            np.zeros(pixels.shape[1]),
            self._turns(plane[:1])[reference : reference + 1],
        )
        energy = (gradient**2).sum(axis=0)
        strongest = float(np.percentile(energy, 99)) if energy.size else 0.0
        paths = self.paths(pixels[:, energy > _MIN_ENERGY * strongest], plane)
        paths = paths.only(self._inside(paths.places_px))
        if paths.pixels.size == 0:
            raise SlopeError(
                "board found, but no edge of it is seen by all views",
                advice="move it to the middle",
            )
        return paths

    def _inside(self, places_px: Float, which: Sequence[int] | None = None) -> NDArray[np.bool_]:
        used = self.used if which is None else [self.used[place] for place in which]
        shapes = np.array([self.views.images[view].shape for view in used])
        height, width = shapes.T[:, :, None]
        x, y = places_px[:, 0], places_px[:, 1]
        return ((x >= 3) & (x <= width - 4) & (y >= 3) & (y <= height - 4)).all(axis=0)

    def _places(self, pixels: Float, slope_px: Float, which: Sequence[int] | None = None) -> Float:
        beside = self.misalignment.at(pixels)
        return np.stack(
            [
                self.views.places_px(self.used[place], pixels, slope_px, beside[place])
                for place in (range(len(self.used)) if which is None else which)
            ]
        )

    def _turns(self, slope_px: Float) -> Float:
        x, y = self.centre_px
        cross = np.array([[x - 0.5, x + 0.5, x, x], [y, y, y - 0.5, y + 0.5]])
        places = self._places(cross, np.repeat(slope_px, 4))
        return np.stack([places[:, :, 1] - places[:, :, 0], places[:, :, 3] - places[:, :, 2]], -1)
