"""Normal equations with the boards eliminated (Schur complement), and their solution.

Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment - a modern synthesis", 1999, section 6:
each board's pose touches only its own picture, so its 6 x 6 block is inverted alone.
"""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.kernels import (
    Sightings,
    Sums,
    accumulate,
    eliminate,
    factorise,
    solve_factorised,
    subtract_gram,
)
from rig.geometry.bundle.linearise import Linearised, Target, share_out
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.priors import Pull, StageStops, pull_of_shared, stage_rows
from rig.geometry.bundle.unknowns import POSE, Int, Layout, Unknowns


@dataclass(frozen=True, slots=True)
class Normal:
    """Blocks of the normal equations; P shared unknowns, N pictures."""

    shared: Float
    """(N, P, P) of each picture: its points and, on the stage, its tie to the line."""
    side: Float
    """(N, P)."""
    prior: Pull
    """Of the shared unknowns."""
    between: Float
    """(N, 6, P)."""
    pose: Float
    """(N, 6, 6)."""
    pull: Float
    """(N, 6)."""
    follow: Float
    """(S, 6, C + 7) how motions follow from steps of local columns and pose; S = 0 at rest."""

    def reduced(self, damping: float = 0.0) -> "Reduced | None":
        """Eliminate the boards; None where a board's pose is not determined."""
        pose, pull, between = self.pose.copy(), self.pull.copy(), self.between.copy()
        if not eliminate(pose, pull, between, damping):
            return None
        matrix = self.shared.sum(axis=0)
        diagonal = np.diag_indices_from(matrix)
        matrix[diagonal] = (matrix[diagonal] + self.prior.information) * (1.0 + damping)
        subtract_gram(matrix, between.reshape(POSE * len(pull), len(matrix)))
        side = self.side.sum(axis=0) + self.prior.side
        side -= np.einsum("nip,ni->p", between, pull)
        return Reduced(matrix, side, pose, pull, between)


@dataclass(frozen=True, slots=True)
class Reduced:
    """The shared unknowns alone, and what is needed to come back to the boards."""

    matrix: Float
    """(P, P) information about the shared unknowns."""
    side: Float
    """(P,)."""
    pose: Float
    """(N, 6, 6) lower Cholesky factors L."""
    pull: Float
    """(N, 6) L^-1 pull."""
    between: Float
    """(N, 6, P) L^-1 between."""

    def step(self) -> tuple[Float, Float] | None:
        """Shared step (P,) and board steps (N, 6); None where the matrix is not definite."""
        shared = solve(self.matrix, self.side[:, None])
        if shared is None:
            return None
        boards = self.pull - np.einsum("nip,p->ni", self.between, shared[:, 0])
        for i in range(POSE - 1, -1, -1):
            above = np.einsum("nk,nk->n", self.pose[:, i + 1 :, i], boards[:, i + 1 :])
            boards[:, i] = (boards[:, i] - above) / self.pose[:, i, i]
        return shared[:, 0], boards


def solve(matrix: Float, sides: Float) -> Float | None:
    """A^-1 sides (P, K) of a positive definite A; None where it is not.

    Unknowns of different units are scaled to a unit diagonal first.
    """
    diagonal = np.diag(matrix)
    if not (np.isfinite(matrix).all() and (diagonal > 0).all()):
        return None
    scale = 1.0 / np.sqrt(diagonal)
    factor = matrix * scale * scale[:, None]
    if not factorise(factor):
        return None
    answer = np.ascontiguousarray(sides * scale[:, None])
    solve_factorised(factor, answer)
    return answer * scale[:, None]


def sum_up(
    sightings: Sightings, columns: Int, pictures: int, count: int, tie: Float, motion: Float
) -> Sums:
    """Sum all sightings; pictures are shared between threads, and each is summed in one order."""
    sums = Sums.none_yet(pictures, count, len(tie), sightings.jacobian.shape[2])
    edges = np.searchsorted(sightings.picture, np.arange(pictures + 1)).tolist()

    def work(first: int, last: int) -> None:
        accumulate(sightings, columns, tie, motion, edges[first], edges[last], sums)

    share_out(work, pictures, len(sightings.weight))
    return sums


def form(
    observed: Observations,
    target: Target,
    at: Unknowns,
    layout: Layout,
    linear: Linearised,
    weight: Float,
    stops: StageStops | None,
    tie: Float | None = None,
) -> Normal:
    """Sum the normal equations of points, priors and stage.

    Args:
        observed: M points in N pictures.
        target: the board.
        at: where `linear` was taken.
        layout: of the P shared unknowns.
        linear: residuals and derivatives.
        weight: (M,) inverse variances, px^-2; 0 leaves a point out.
        stops: pictures on the stage, if one took part.
        tie: (S, 6, 6) information that holds motions between views near zero; None where views
            show a board at rest.
    """
    if tie is None or at.motion is None:
        tie, motion = np.zeros((0, POSE, POSE)), np.zeros((0, POSE))
    else:
        motion = at.motion
    sightings = Sightings(
        linear.jacobian,
        linear.residual_px,
        weight,
        observed.start,
        observed.picture,
        observed.view,
    )
    shared, side, between, pose, pull, follow = sum_up(
        sightings, layout.sighting_columns, len(observed.pictures), layout.count, tie, motion
    )
    if stops is not None:
        rows = stage_rows(at, stops)
        columns, picture = layout.stage_columns, stops.picture
        pose[picture] += np.diag(rows.by_pose**2)
        pull[picture] += rows.by_pose * rows.residual
        if columns[0] >= 0:
            by_stage = rows.by_stage
            between[np.ix_(picture, np.arange(POSE), columns)] += rows.by_pose[:, None] * by_stage
            shared[np.ix_(picture, columns, columns)] += np.einsum(
                "kia,kib->kab", by_stage, by_stage
            )
            side[np.ix_(picture, columns)] += np.einsum("kia,ki->ka", by_stage, rows.residual)
    return Normal(shared, side, pull_of_shared(at, layout, target), between, pose, pull, follow)


def follow_on(
    normal: Normal, observed: Observations, layout: Layout, shared: Float, boards: Float
) -> Float | None:
    """Motions (S, 6) that fit best after a step of the shared unknowns (P,) and boards (N, 6)."""
    if not len(normal.follow):
        return None
    full = np.concatenate([shared, [0.0]])  # index -1: fixed
    local = full[layout.sighting_columns[observed.view]]
    step = np.concatenate([local, boards[observed.picture], -np.ones((len(local), 1))], axis=1)
    return -np.einsum("sik,sk->si", normal.follow, step)
