"""What the solve is after: cameras, their places, the board's shape and poses, the stage."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.rotations import apply, cross_matrix, times, turns
from rig.geometry.lens import COEFFICIENTS, LensModel

Int = NDArray[np.int64]

WARP = 3
"""Terms of the board's bending: X^2, X Y, Y^2."""
STAGE = 9
"""Orientation 3, origin 3, axis 2, scale 1."""
POSE = 6
"""A turn (rad) and a shift (mm)."""


@dataclass(frozen=True, slots=True)
class StageLine:
    """The board on the stage: one orientation, moved along one line."""

    rotation: Float
    """(3, 3) reference_from_board."""
    origin_mm: Float
    """(3,) the board's origin at the middle driver position `middle_mm`."""
    axis: Float
    """(3,) unit vector of growing positions."""
    scale: float
    """True mm per mm of the driver."""
    middle_mm: float
    """Driver position that `origin_mm` belongs to."""

    @property
    def across(self) -> Float:
        """(2, 3) unit vectors that span the directions the axis may turn to."""
        aside = np.eye(3)[0 if abs(self.axis[1]) > 0.9 else 1]
        first = apply(cross_matrix(aside), self.axis)
        first /= np.sqrt(np.sum(first**2))
        return np.stack([first, apply(cross_matrix(self.axis), first)])

    def moved(self, step: Float) -> "StageLine":
        """Return the line after a step (9,)."""
        axis = self.axis + step[6] * self.across[0] + step[7] * self.across[1]
        return replace(
            self,
            rotation=times(turns(step[:3]), self.rotation),
            origin_mm=self.origin_mm + step[3:6],
            axis=axis / np.sqrt(np.sum(axis**2)),
            scale=self.scale + float(step[8]),
        )


@dataclass(frozen=True, slots=True)
class Unknowns:
    """One value of everything; V views, N pictures."""

    lenses: tuple[LensModel, ...]
    """Per view."""
    intrinsics: tuple[Float, ...]
    """Per view fx, fy, cx, cy and the lens coefficients."""
    view_rotation: Float
    """(V, 3, 3) cam_from_reference."""
    view_shift_mm: Float
    """(V, 3)."""
    warp_mm: Float
    """(3,) heights of X^2, X Y, Y^2."""
    board_rotation: Float
    """(N, 3, 3) reference_from_board."""
    board_shift_mm: Float
    """(N, 3)."""
    stage: StageLine | None = None
    motion: Float | None = None
    """(S, 6) turn about the board's origin and shift, from a picture's pose of the board to what
    each of its sightings shows; None where views show a board at rest."""

    def boards_shown(self, picture: Int) -> tuple[Float, Float]:
        """Rotation (S, 3, 3) and shift (S, 3) of the board in sightings of pictures (S,)."""
        rotation, shift_mm = self.board_rotation[picture], self.board_shift_mm[picture]
        if self.motion is None:
            return rotation, shift_mm
        return times(turns(self.motion[:, :3]), rotation), shift_mm + self.motion[:, 3:]

    def moved(
        self, layout: "Layout", shared: Float, boards: Float, motion: Float | None = None
    ) -> "Unknowns":
        """Return what a step leads to.

        Args:
            layout: of the shared unknowns.
            shared: (P,) step of the shared unknowns.
            boards: (N, 6) turn and shift of each board.
            motion: (S, 6) after the step, if there is any.
        """
        full = np.concatenate([shared, [0.0]])  # index -1: fixed
        intrinsics = tuple(
            values + full[layout.view_columns[view, : len(values)]]
            for view, values in enumerate(self.intrinsics)
        )
        places = full[layout.view_columns[:, -POSE:]]
        stage = self.stage
        if stage is not None:
            stage = stage.moved(full[layout.stage_columns])
        return Unknowns(
            lenses=self.lenses,
            intrinsics=intrinsics,
            view_rotation=times(turns(places[:, :3]), self.view_rotation),
            view_shift_mm=self.view_shift_mm + places[:, 3:],
            warp_mm=self.warp_mm + full[layout.warp_columns],
            board_rotation=times(turns(boards[:, :3]), self.board_rotation),
            board_shift_mm=self.board_shift_mm + boards[:, 3:],
            stage=stage,
            motion=motion,
        )

    def with_boards(self, kept: NDArray[np.bool_], shown: NDArray[np.bool_]) -> "Unknowns":
        """Return only the boards of (N,) kept pictures, in the (S,) sightings of these."""
        return replace(
            self,
            motion=None if self.motion is None else self.motion[shown],
            board_rotation=self.board_rotation[kept],
            board_shift_mm=self.board_shift_mm[kept],
        )


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the shared unknowns stand in one vector; -1 where something is fixed."""

    view_columns: Int
    """(V, 4 + K + 6): intrinsics, padded to the longest, then the place of the view."""
    warp_columns: Int
    """(3,)."""
    stage_columns: Int
    """(9,)."""
    count: int
    """P, how many there are."""

    @property
    def sighting_columns(self) -> Int:
        """(V, 4 + K + 6 + 3): what a sighting of each view depends on beside its board's pose."""
        warp = np.broadcast_to(self.warp_columns, (len(self.view_columns), WARP))
        return np.ascontiguousarray(np.concatenate([self.view_columns, warp], axis=1))


@dataclass(frozen=True, slots=True)
class Free:
    """Which groups of shared unknowns a solve moves."""

    intrinsics: bool = True
    lens: bool = True
    places: bool = True
    warp: bool = True
    stage: bool = True
    motion: bool = True
    """Of the board between the views of a picture, where the pictures show one."""


def lay_out(lenses: tuple[LensModel, ...], reference: int, free: Free, *, stage: bool) -> Layout:
    """Number the free shared unknowns in the order of `RigGeometry`, then warp and stage."""
    counts = [COEFFICIENTS[lens] for lens in lenses]
    columns = np.full((len(lenses), 4 + max(counts) + POSE), -1, np.int64)
    at = 0
    for view, count in enumerate(counts):
        size = (4 + (count if free.lens else 0)) if free.intrinsics else 0
        columns[view, :size] = np.arange(at, at + size)
        at += size
    for view in range(len(lenses)):
        if view != reference and free.places:
            columns[view, -POSE:] = np.arange(at, at + POSE)
            at += POSE
    warp = np.arange(at, at + WARP) if free.warp else np.full(WARP, -1)
    at += WARP if free.warp else 0
    moves = stage and free.stage
    line = np.arange(at, at + STAGE) if moves else np.full(STAGE, -1)
    at += STAGE if moves else 0
    return Layout(columns, warp.astype(np.int64), line.astype(np.int64), at)
