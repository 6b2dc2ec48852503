"""Sums and factors of the normal equations against dense linear algebra."""

from dataclasses import dataclass

import numpy as np
import pytest

from rig.arrays import Float
from rig.geometry.bundle.kernels import (
    Sightings,
    eliminate,
    factorise,
    solve_factorised,
    subtract_gram,
)
from rig.geometry.bundle.normal import Normal, solve, sum_up
from rig.geometry.bundle.priors import Pull
from rig.geometry.bundle.uncertainty import _forward, picture_information

COLUMNS = np.array([[0, 1, -1, 4], [2, -1, 3, 4]])
"""Four local columns of two views among five shared unknowns; -1 is fixed."""
VIEW, PICTURE = np.array([0, 1, 0, 1, 1]), np.array([0, 0, 1, 1, 2])
START = np.array([0, 9, 17, 24, 35, 44])
COUNT, BOARDS = 5, 3


def positive(size: int, seed: int) -> Float:
    root = np.random.default_rng(seed).normal(size=(size, size + 3))
    return root @ root.T


@dataclass(frozen=True)
class Sums:
    """Random sightings, with ties or at rest."""

    jacobian: Float
    residual: Float
    weight: Float
    tie: Float
    motion: Float

    @classmethod
    def drawn(cls, *, tied: bool) -> "Sums":
        numbers = np.random.default_rng(5)
        weight = numbers.uniform(0.5, 2.0, 44)
        weight[[3, 20]] = 0.0
        sightings = 5 if tied else 0
        return cls(
            numbers.normal(size=(44, 2, 10)),
            numbers.normal(size=(44, 2)),
            weight,
            np.stack([positive(6, 10 + s) for s in range(5)])[:sightings],
            0.3 * numbers.normal(size=(sightings, 6)),
        )

    def normal(self) -> Normal:
        shared, side, between, pose, pull, follow = sum_up(
            Sightings(self.jacobian, self.residual, self.weight, START, PICTURE, VIEW),
            COLUMNS, BOARDS, COUNT, self.tie, self.motion,
        )  # fmt: skip
        prior = Pull(np.full(COUNT, 0.5), np.linspace(-1.0, 1.0, COUNT), 0.0)
        return Normal(shared, side, prior, between, pose, pull, follow)

    def dense(self) -> tuple[Float, Float]:
        """Information about shared unknowns, boards and motions after the step, and its side."""
        motions = 6 * len(self.tie)
        size = COUNT + 6 * BOARDS + motions
        matrix, side = np.zeros((size, size)), np.zeros(size)
        for s, (view, picture) in enumerate(zip(VIEW, PICTURE, strict=True)):
            board = COUNT + 6 * picture
            own = COUNT + 6 * BOARDS + 6 * s
            for m in range(START[s], START[s + 1]):
                for axis in range(2):
                    row = np.zeros(size)
                    for local, column in enumerate(COLUMNS[view]):
                        row[column] += self.jacobian[m, axis, local] if column >= 0 else 0.0
                    pose = self.jacobian[m, axis, 4:]
                    row[board : board + 6] = pose
                    wanted = self.residual[m, axis]
                    if motions:
                        row[own : own + 6] = pose
                        wanted += pose @ self.motion[s]
                    matrix += self.weight[m] * np.outer(row, row)
                    side += self.weight[m] * row * wanted
            if motions:
                matrix[own : own + 6, own : own + 6] += self.tie[s]
        diagonal = np.arange(COUNT)
        matrix[diagonal, diagonal] += 0.5
        side[:COUNT] += np.linspace(-1.0, 1.0, COUNT)
        return matrix, side


@pytest.mark.parametrize("tied", [False, True])
def test_a_step_is_that_of_the_whole_system(tied: bool) -> None:
    sums = Sums.drawn(tied=tied)
    normal = sums.normal()
    reduced = normal.reduced()
    assert reduced is not None
    step = reduced.step()
    assert step is not None
    matrix, side = sums.dense()
    answer = np.linalg.solve(matrix, side)
    assert step[0] == pytest.approx(answer[:COUNT], rel=1e-9, abs=1e-11)
    assert step[1].ravel() == pytest.approx(answer[COUNT : COUNT + 18], rel=1e-9, abs=1e-11)
    covariance = np.linalg.inv(matrix)[:COUNT, :COUNT]
    assert solve(reduced.matrix, np.eye(COUNT)) == pytest.approx(covariance, rel=1e-9, abs=1e-12)
    assert len(normal.follow) == len(sums.tie)
    for s, follow in enumerate(normal.follow):
        local = np.where(COLUMNS[VIEW[s]] >= 0, step[0][COLUMNS[VIEW[s]]], 0.0)
        given = np.concatenate([local, step[1][PICTURE[s]], [-1.0]])
        motion = answer[COUNT + 18 + 6 * s :][:6]
        assert -follow @ given == pytest.approx(motion, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("tied", [False, True])
def test_information_of_each_picture_is_without_its_pose(tied: bool) -> None:
    sums = Sums.drawn(tied=tied)
    normal = sums.normal()
    reduced = normal.reduced()
    assert reduced is not None
    found = picture_information(normal, reduced)
    for n in range(BOARDS):
        taken = normal.between[n].T @ np.linalg.inv(normal.pose[n]) @ normal.between[n]
        assert found[n] == pytest.approx(normal.shared[n] - taken, rel=1e-9, abs=1e-10)


def test_damping_multiplies_every_diagonal() -> None:
    normal = Sums.drawn(tied=False).normal()
    reduced = normal.reduced(0.25)
    assert reduced is not None
    matrix = normal.shared.sum(axis=0) + np.diag(normal.prior.information)
    matrix += 0.25 * np.diag(np.diag(matrix))
    side = normal.side.sum(axis=0) + normal.prior.side
    for pose, pull, between in zip(normal.pose, normal.pull, normal.between, strict=True):
        inverse = np.linalg.inv(pose + 0.25 * np.diag(np.diag(pose)))
        matrix -= between.T @ inverse @ between
        side -= between.T @ inverse @ pull
    assert reduced.matrix == pytest.approx(matrix, rel=1e-9, abs=1e-10)
    assert reduced.side == pytest.approx(side, rel=1e-9, abs=1e-10)


def test_a_board_that_is_not_determined_ends_the_elimination() -> None:
    pose = np.stack([positive(6, 1), np.zeros((6, 6))])
    assert not eliminate(pose, np.zeros((2, 6)), np.zeros((2, 6, 3)), 0.0)
    nothing = np.zeros((BOARDS, 6, 6))
    normal = Sums.drawn(tied=False).normal()
    flat = Normal(
        normal.shared, normal.side, normal.prior, normal.between, nothing, normal.pull,
        normal.follow,
    )  # fmt: skip
    assert flat.reduced() is None


def test_factors_and_solutions() -> None:
    matrix, sides = positive(7, 3), np.random.default_rng(4).normal(size=(7, 3))
    factor = matrix.copy()
    assert factorise(factor)
    assert np.tril(factor) == pytest.approx(np.linalg.cholesky(matrix), rel=1e-10)
    answer = sides.copy()
    solve_factorised(factor, answer)
    assert answer == pytest.approx(np.linalg.solve(matrix, sides), rel=1e-8)
    half = sides.copy()
    _forward(np.tril(factor), half)
    assert half == pytest.approx(np.linalg.solve(np.linalg.cholesky(matrix), sides), rel=1e-9)
    scaled = solve(matrix, sides)
    assert scaled == pytest.approx(np.linalg.solve(matrix, sides), rel=1e-8)


@pytest.mark.parametrize("last", [0.0, -1.0, np.nan])
def test_what_is_not_definite_has_no_factor(last: float) -> None:
    assert not factorise(np.diag([1.0, 2.0, last]))
    assert solve(np.diag([1.0, 2.0, last]), np.eye(3)) is None
    assert solve(np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2)) is None


def test_a_gram_is_taken_away() -> None:
    numbers = np.random.default_rng(6)
    matrix, rows = numbers.normal(size=(4, 4)), numbers.normal(size=(9, 4))
    rows[2, 1] = 0.0
    wanted = matrix - rows.T @ rows
    subtract_gram(matrix, rows)
    assert matrix == pytest.approx(wanted, rel=1e-12)
