"""Boards that move between views, and how sure a solve is, beside dense linear algebra."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.hold_out import _part, picture_squares_px2
from rig.geometry.bundle.linearise import Linearised, Target, linearise
from rig.geometry.bundle.motion import CERTAIN, FREEDOM, Motion, measure_motion, notice_motion
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.priors import StageStops, pull_of_shared
from rig.geometry.bundle.settle import Problem
from rig.geometry.bundle.uncertainty import measure_uncertainty
from rig.geometry.bundle.unknowns import Free, Unknowns, lay_out
from tests.support.calibration_scene import random_scene
from tests.unit.geometry.calibration.test_linearise import setting

PICTURES = 4


@dataclass(frozen=True)
class Solve:
    """A linearised solve with residuals that are drawn, not solved for."""

    observed: Observations
    target: Target
    at: Unknowns
    problem: Problem
    linear: Linearised
    weight: Float

    @property
    def sightings(self) -> int:
        return len(self.observed.view)


def drawn(moved: float, motion: Float | None = None, tie: Float | None = None) -> Solve:
    """Residuals of noise, and of boards that moved by so many times 1e-3 rad and 0.5 mm."""
    observed, target, at = setting(("brown5",) * 3)
    at = replace(at, motion=motion)
    layout = lay_out(at.lenses, 0, Free(), stage=False)
    problem = Problem(observed, target, layout, None, tie)
    rng = np.random.default_rng(17)
    plain = linearise(observed, target, at)
    steps = moved * rng.normal(size=(len(observed.view), 6)) * np.repeat([1e-3, 0.5], 3)
    residual = 0.05 * rng.normal(size=plain.residual_px.shape)
    sighting = observed.sighting_of_point
    residual += np.einsum("mai,mi->ma", plain.jacobian[:, :, -6:], steps[sighting])
    weight = rng.uniform(300.0, 500.0, len(residual))
    weight[[2, 40, 100]] = 0.0
    solve = Solve(observed, target, at, problem, Linearised(residual, plain.jacobian), weight)
    left = left_by_a_step(solve)
    left[weight == 0] = np.inf  # as behind a camera: whatever it is, it has no weight
    return replace(solve, linear=Linearised(left, plain.jacobian))


def left_by_a_step(solve: Solve) -> Float:
    """Residuals (M, 2) without what shared unknowns and boards explain: those of a solution."""
    rows, residual, weight = rows_of(solve)
    root = np.sqrt(weight)
    scale = 1 / np.sqrt((weight[:, None] * rows**2).sum(axis=0))
    step = np.linalg.lstsq(root[:, None] * rows * scale, root * residual)[0] * scale
    return (residual - rows @ step).reshape(-1, 2)


def rows_of(solve: Solve) -> tuple[Float, Float, Float]:
    """(2 M, P + 6 N) derivatives, (2 M,) residuals and weights of all coordinates."""
    observed, layout = solve.observed, solve.problem.layout
    count = layout.count
    size = count + 6 * PICTURES
    rows = np.zeros((len(solve.weight), 2, size))
    for m, s in enumerate(observed.sighting_of_point):
        columns = layout.sighting_columns[observed.view[s]]
        for local, column in enumerate(columns):
            if column >= 0:
                rows[m, :, column] += solve.linear.jacobian[m, :, local]
        board = count + 6 * observed.picture[s]
        rows[m, :, board : board + 6] = solve.linear.jacobian[m, :, -6:]
    residual = np.where(solve.weight[:, None] > 0, solve.linear.residual_px, 0.0)
    return rows.reshape(-1, size), residual.ravel(), np.repeat(solve.weight, 2)


def about_middle(solve: Solve, s: int) -> Float:
    """(6, 6) from a motion about the board's origin to one about its middle."""
    rotation = solve.at.board_rotation[solve.observed.picture[s]]
    a, b, c = rotation @ np.array([*solve.target.centre_mm, 0.0])
    matrix = np.eye(6)
    matrix[3:, :3] = -np.array([[0, -c, b], [c, 0, -a], [-b, a, 0]])
    return matrix


def of_sighting(solve: Solve, s: int) -> slice:
    return slice(2 * int(solve.observed.start[s]), 2 * int(solve.observed.start[s + 1]))


def plain_notice(solve: Solve, resting: NDArray[np.bool_]) -> tuple[float, Float]:
    """How certain a motion is, and a first guess of its scales."""
    rows, residual, weight = rows_of(solve)
    information = rows.T @ (weight[:, None] * rows)
    prior = pull_of_shared(solve.at, solve.problem.layout, solve.target).information
    information[: len(prior), : len(prior)] += np.diag(prior)
    covariance = np.linalg.inv(information)
    pulls, spreads, owns = [], [], []
    for s in range(solve.sightings):
        if resting[solve.observed.picture[s]]:
            continue
        part = of_sighting(solve, s)
        pose = solve.linear.jacobian[:, :, -6:].reshape(-1, 6)[part]
        weighted = pose.T * weight[part]
        back = np.linalg.inv(about_middle(solve, s))
        to_all = weighted @ rows[part]
        own = weighted @ pose
        pulls.append(back.T @ weighted @ residual[part])
        owns.append(back.T @ own @ back)
        spreads.append(back.T @ (own - to_all @ covariance @ to_all.T) @ back)
    certain, sigma = 0.0, np.zeros(2)
    for kind, part in enumerate((slice(0, 3), slice(3, 6))):
        g, h = np.array(pulls)[:, part], np.array(spreads)[:, part, part]
        excess = (g**2).sum() - np.trace(h, axis1=1, axis2=2).sum()
        certain = max(certain, excess / np.sqrt(2 * (h**2).sum()))
        apart = [
            np.linalg.solve(o, p) for o, p in zip(np.array(owns)[:, part, part], g, strict=True)
        ]
        sigma[kind] = np.sqrt(np.median((np.array(apart) ** 2).sum(axis=1)) / 3)
    return float(certain), sigma


@pytest.mark.parametrize("moved", [0.0, 1.0])
@pytest.mark.parametrize("rests", [(), (1,)])
def test_a_motion_is_noticed_where_sightings_pull_apart_by_six_sigmas(
    moved: float, rests: tuple[int, ...]
):
    solve = drawn(moved)
    resting = np.isin(np.arange(PICTURES), rests)
    found = notice_motion(solve.problem, solve.at, solve.linear, solve.weight, resting)
    certain, sigma = plain_notice(solve, resting)
    assert (found is not None) == (certain > CERTAIN) == (moved > 0)
    if found is not None:
        assert found.sigma == pytest.approx(sigma, rel=1e-6)
        assert found.picture_scale.tolist() == np.where(resting, 0.0, 1.0).tolist()
        assert found.dof == 0.0
        # About as large as it was drawn, rather more.
        assert (found.sigma > [5e-4, 0.25]).all()
        assert (found.sigma < [1e-2, 5.0]).all()


def test_where_all_boards_rest_no_motion_is_looked_for():
    solve = drawn(1.0)
    everywhere = np.ones(PICTURES, np.bool_)
    assert notice_motion(solve.problem, solve.at, solve.linear, solve.weight, everywhere) is None


def test_no_board_moves_between_views_where_one_view_alone_sees_it():
    solve, rest = drawn(8.0), np.zeros(PICTURES, np.bool_)
    few = lay_out(solve.at.lenses, 0, Free(intrinsics=False, places=False), stage=False)
    problem = replace(solve.problem, layout=few)
    assert notice_motion(problem, solve.at, solve.linear, solve.weight, rest) is not None
    first = np.unique(solve.observed.picture, return_index=True)[1]
    alone = np.isin(solve.observed.sighting_of_point, first)
    weight = np.where(alone, solve.weight, 0.0)
    assert notice_motion(problem, solve.at, solve.linear, weight, rest) is None


MOTION = Motion(np.array([2e-3, 0.8]), np.array([1.0, 0.5, 0.0, 2.0]), 3.0)


def test_scales_of_sightings_are_those_of_their_pictures_and_never_nothing():
    solve = drawn(0.0)
    sigmas = MOTION.sigmas(solve.observed)
    for s, picture in enumerate(solve.observed.picture):
        scale = MOTION.picture_scale[picture]
        expected = [2e-3 * scale, 0.8 * scale] if scale else [1e-9, 1e-6]
        assert sigmas[s] == pytest.approx(expected)
    ties = MOTION.ties(solve.at, solve.target, solve.observed)
    for s in range(solve.sightings):
        middle = about_middle(solve, s)
        wanted = middle.T @ np.diag(np.repeat(sigmas[s], 3) ** -2.0) @ middle
        assert ties[s] == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("rests", [(), (2,)])
def test_scales_take_one_step_to_the_likeliest(rests: tuple[int, ...]):
    resting = np.isin(np.arange(PICTURES), rests)
    before = replace(MOTION, picture_scale=np.where(resting, 0.0, [1.0, 0.5, 1.5, 2.0]))
    still = drawn(0.0)
    rng = np.random.default_rng(23)
    motion = rng.normal(size=(still.sightings, 6)) * np.repeat([2e-3, 0.8], 3)
    tie = before.ties(still.at, still.target, still.observed)
    solve = drawn(0.0, motion, tie)
    found = measure_motion(solve.problem, solve.at, solve.linear, solve.weight, before, resting)
    rows, _, weight = rows_of(solve)
    shared = rows.shape[1]
    count = solve.sightings
    full = np.zeros((len(rows), shared + 6 * count))
    full[:, :shared] = rows
    for s in range(count):
        part = of_sighting(solve, s)
        pose = solve.linear.jacobian[:, :, -6:].reshape(-1, 6)[part]
        full[part, shared + 6 * s : shared + 6 * s + 6] = pose
    information = full.T @ (weight[:, None] * full)
    prior = pull_of_shared(solve.at, solve.problem.layout, solve.target).information
    information[: len(prior), : len(prior)] += np.diag(prior)
    for s in range(count):
        own = slice(shared + 6 * s, shared + 6 * s + 6)
        information[own, own] += tie[s]
    scale = 1 / np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    sigmas, squares, decided = (
        before.sigmas(solve.observed),
        np.zeros((count, 2)),
        np.zeros((count, 2)),
    )
    for s in range(count):
        own = slice(shared + 6 * s, shared + 6 * s + 6)
        middle = about_middle(solve, s)
        moved, variance = middle @ motion[s], np.diag(middle @ covariance[own, own] @ middle.T)
        for kind, part in enumerate((slice(0, 3), slice(3, 6))):
            squares[s, kind] = (moved[part] ** 2).sum() / sigmas[s, kind] ** 2
            decided[s, kind] = max(3 - variance[part].sum() / sigmas[s, kind] ** 2, 0.0)
    free = ~resting[solve.observed.picture]
    decided[~free] = 0.0
    factor = squares[free].sum(axis=0) / decided.sum(axis=0)
    assert found.sigma == pytest.approx(before.sigma * np.sqrt(factor), rel=1e-4)
    assert found.dof == pytest.approx(decided.sum(), rel=1e-4)
    for n in range(PICTURES):
        own = solve.observed.picture == n
        told = FREEDOM + (squares[own] / factor).sum() * before.picture_scale[n] ** 2
        expected = 0.0 if resting[n] else np.sqrt(told / (FREEDOM + decided[own].sum()))
        assert found.picture_scale[n] == pytest.approx(expected, rel=1e-4)


def adjusted(residual_scale: float, common: float) -> Any:
    """A solve whose pictures each pull their own way, by `common` px."""
    solve = drawn(0.0)
    weight = solve.weight.copy()
    weight[450:500] = 0.0
    weight[200:400] = 0.5  # hardly believed, and used all the same
    solve = replace(solve, weight=weight)
    rng = np.random.default_rng(29)
    residual = residual_scale * rng.normal(size=solve.linear.residual_px.shape)
    # What each picture has of its own and no pose of its board explains: a bend of the picture.
    place = (solve.observed.xy_px - (640.0, 400.0)) / 640.0
    of_point = solve.observed.picture[solve.observed.sighting_of_point]
    bend = common * rng.normal(size=PICTURES)
    residual += bend[of_point, None] * place * (place**2).sum(axis=1, keepdims=True)
    residual = left_by_a_step(replace(solve, linear=Linearised(residual, solve.linear.jacobian)))
    at = solve.at
    # Move the found corners to where the residuals are these.
    shift = residual - linearise(solve.observed, solve.target, at).residual_px
    observed = replace(solve.observed, xy_px=solve.observed.xy_px + shift)
    problem = replace(solve.problem, observed=observed)
    found: Any = SimpleNamespace(
        problem=problem, at=at, weight=solve.weight, residual_px=residual, motion=None
    )
    return found, replace(
        solve, observed=observed, linear=Linearised(residual, solve.linear.jacobian)
    )


@pytest.mark.parametrize(
    ("common", "told_by_motion"), [(0.0, 0.0), (0.6, 40.0)], ids=["points", "pictures"]
)
def test_sigma_is_that_of_pictures_as_clusters(common: float, told_by_motion: float):
    found, solve = adjusted(0.05, common)
    found.motion = SimpleNamespace(dof=told_by_motion) if told_by_motion else None
    told = measure_uncertainty(found)
    rows, residual, weight = rows_of(solve)
    count = solve.problem.layout.count
    pictures = np.repeat(solve.observed.picture[solve.observed.sighting_of_point], 2)
    pull_prior = pull_of_shared(solve.at, solve.problem.layout, solve.target)
    whole = np.diag(pull_prior.information)
    parts, pulls = [], []
    for n in range(PICTURES):
        own = pictures == n
        full = rows[own].T @ (weight[own, None] * rows[own])
        side = rows[own].T @ (weight[own] * residual[own])
        board = slice(count + 6 * n, count + 6 * n + 6)
        inner = np.linalg.inv(full[board, board])
        parts.append(full[:count, :count] - full[:count, board] @ inner @ full[board, :count])
        pulls.append(side[:count] - full[:count, board] @ inner @ side[board])
    whole = whole + sum(parts)
    inverse = np.linalg.inv(whole)
    spread = sum(g @ inverse @ g for g in pulls)
    free = sum(np.trace(inverse @ a) - np.trace(inverse @ a @ inverse @ a) for a in parts)
    used = weight > 0
    spare = used.sum() / (used.sum() - count - 6 * PICTURES - told_by_motion)
    point = (weight[used] ** 2 * residual[used] ** 2).sum() / weight[used].sum() * spare
    clustering = spread / free / point
    assert told.picture_information == pytest.approx(np.array(parts), rel=1e-4, abs=1e-3)
    assert told.clustering == pytest.approx(clustering, rel=1e-3)
    assert told.scale == pytest.approx(point * max(clustering, 1.0), rel=1e-3)
    assert (clustering > 1) == (common > 0)
    assert told.covariance == pytest.approx(told.covariance.T)
    ratio = np.diag(told.covariance) / np.diag(inverse) / told.scale
    # Pictures that agree leave the model's own; others widen some directions, and narrow none much.
    assert ratio == pytest.approx(np.ones(count), rel=1e-3) if common == 0 else (ratio > 0.3).all()


def test_residuals_of_a_picture_are_freed_of_its_pose():
    found, solve = adjusted(0.05, 0.0)
    residual = found.residual_px
    told = picture_squares_px2(found, residual)
    picture = solve.observed.picture[solve.observed.sighting_of_point]
    for n in range(PICTURES):
        used = (picture == n) & (solve.weight > 0)
        square = float((residual[used] ** 2).sum())
        assert told[n] == pytest.approx(2 * square / (2 * used.sum() - 6))
    few = SimpleNamespace(problem=found.problem, weight=np.where(picture == 1, 0.0, solve.weight))
    few.weight[np.flatnonzero(picture == 1)[:3]] = 1.0
    assert np.isnan(picture_squares_px2(few, residual)[1])  # pyright: ignore[reportArgumentType]
    few.weight[np.flatnonzero(picture == 1)[:4]] = 1.0
    assert np.isfinite(picture_squares_px2(few, residual)[1])  # pyright: ignore[reportArgumentType]


def test_a_part_of_a_problem_keeps_stops_and_ties_of_its_pictures():
    solve = drawn(0.0)
    stops = StageStops(np.array([1, 2, 3]), np.array([10.0, 20.0, 30.0]))
    tie = np.arange(solve.sightings, dtype=float)[:, None, None] * np.eye(6)
    problem = replace(solve.problem, stops=stops, tie=tie)
    part = _part(problem, np.array([True, False, True, True]))
    assert part.stops is not None
    assert part.stops.picture.tolist() == [1, 2]
    assert part.stops.position_mm.tolist() == [20.0, 30.0]
    kept = solve.observed.picture != 1
    assert part.tie is not None
    assert part.tie[:, 0, 0].tolist() == np.flatnonzero(kept).tolist()
    assert len(part.observed.view) == kept.sum()
    bare = _part(solve.problem, np.array([True, False, True, True]))
    assert (bare.stops, bare.tie) == (None, None)


def test_the_scene_has_as_many_pictures_as_these_tests_say():
    assert len(random_scene(5, 4).poses) == PICTURES == len(setting(("brown5",) * 3)[0].pictures)
