"""The least squares that tell where views are: solved, judged, and what they leave unknown.

Slopes and grey values of the pixels are eliminated pixel by pixel (`rig.epipolar.placement.fit`).
What the places leave unexplained is not white: neighbouring pixels share what the model of the
picture does not know (gloss, shade, aliasing, a slope that is wrong). So sigma comes from how the
cells of the picture contradict each other (K.-Y. Liang and S. Zeger, "Longitudinal data analysis
using generalized linear models", Biometrika 73, 1986), and a place is believed only where what one
half of the cells, as on a chess-board, says about it makes the views agree better in the other
half.

How large errors of places are, the pictures tell as well; the same must be expected of the parts
that no match can know (empirical Bayes: B. Efron and C. Morris, "Stein's estimation rule and its
competitors - an empirical Bayes approach", J. Am. Stat. Assoc. 68, 1973).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.placement.equations import (
    UNKNOWNS,
    Eliminated,
    Lines,
    eliminate,
    normal_equations_of_halves,
    summed,
)

_DOUBT_SIGMAS, _ROUNDS = 3.0, 2
_EXPECTED_PX, _HELD = 0.3, 1e8
"""Error of a place that is believed without evidence, 1 sigma; and how many times stronger than
that what cannot be known is held."""
_ON_A_LINE = 0.1
"""Width of an array, as a share of its length, up to which its views stand on one line: a turn of
such a line is one slope more for every pixel."""
_FEWEST_BELIEVED = 0.3
_SCALE_ROUNDS, _SMALLEST_PX = 4, 1e-5


@dataclass(frozen=True, slots=True)
class Fit:
    """Places as the lines tell them, (V, 4) each, and what they rest on."""

    found: Float
    covariance: Float
    """(4 V, 4 V), of clusters."""
    gain: Float
    """(V,) by how many of its sigmas the misfit of the half that was not asked falls."""
    information: Float
    """(4 V, 4 V) and (4 V,): normal equations, to scale with `covariance`."""
    right: Float


def fit_places(
    lines: Lines, x_steps: Float, y_steps: Float, reference: int, noise_levels: float
) -> Fit:
    """Fit the places of all views.

    Args:
        lines: what is seen.
        x_steps: (V,) where the views are told to be.
        y_steps: (V,).
        reference: index of the view at (0, 0), which has no error.
        noise_levels: white noise of the grey values, 1 sigma; its scale is found here.
    """
    tilt = lines.tilts(x_steps, y_steps)
    prior = _prior(x_steps, y_steps, reference, float(np.abs(lines.slope_px).max()))
    first = _solve(lines, lines.seen.astype(np.float64), tilt, prior, noise_levels)
    left = first.left / np.maximum(first.eliminated.root, 1e-12)
    # A grey value and a slope of each pixel take up two of its differences.
    free = np.maximum(lines.seen.sum(axis=1) - 2, 0).sum() / max(int(lines.seen.sum()), 1)
    scatter = 1.4826 * float(np.median(np.abs(left[lines.seen])))
    noise_levels = max(scatter / max(float(free), 0.1) ** 0.5, 1e-9)
    weight = lines.seen / (1.0 + (left / (_DOUBT_SIGMAS * noise_levels)) ** 2)
    last = _solve(lines, weight, tilt, prior, noise_levels)
    meat = _scatter_of_cells(last.eliminated.root * last.left, lines.design, lines.cells)
    meat /= (noise_levels**2 * _narrowed(weight[lines.seen])) ** 2
    expected = float(np.vdot(last.normal, last.bread))
    dispersion = max(float(np.vdot(meat, last.bread)) / expected, 1.0)
    return Fit(
        last.found,
        last.bread @ (meat + prior) @ last.bread,
        _held_out_gain(lines, last, prior * noise_levels**2),
        last.normal / dispersion,
        last.right / dispersion,
    )


@dataclass(frozen=True, slots=True)
class _Solution:
    """One round of the fit, at given weights."""

    eliminated: Eliminated
    parts: tuple[tuple[Float, Float], ...]
    """Normal equations of both halves of the pixels."""
    normal: Float
    """And of both together, per variance of the noise."""
    right: Float
    bread: Float
    """Covariance if the noise were white."""
    found: Float
    left: Float
    """(N, V) what is unexplained, times the root of the weights."""


def _solve(lines: Lines, weight: Float, tilt: Float, prior: Float, noise: float) -> _Solution:
    eliminated = eliminate(weight, tilt)
    parts = normal_equations_of_halves(lines, eliminated)
    (one, of_one), (other, of_other) = parts
    normal, right = (one + other) / noise**2, (of_one + of_other) / noise**2
    bread = _inverse(normal + prior)
    found = (bread @ right).reshape(-1, UNKNOWNS)
    left = eliminated.rest(lines.difference - lines.design @ found.T)
    return _Solution(eliminated, parts, normal, right, bread, found, left)


def _inverse(matrix: Float) -> Float:
    return np.asarray(np.linalg.inv(matrix), np.float64)


def expect_alike(
    fit: Fit, is_misplaced: NDArray[np.bool_], reference: int, largest_px: float
) -> tuple[Float, Float]:
    """Fit again, expecting of each view the error that its kind has: misplaced views, and the rest.

    Nothing is held: of what no match can know, the views that are right tell what can be told, and
    the rest is as uncertain as the errors of such views are large.

    Args:
        fit: of `fit_places`.
        is_misplaced: (V,) the kind of each view.
        reference: index of the view that has no error.
        largest_px: slope at which an error of a position amounts to one of a picture.

    Returns:
        Places (V, 4), and their covariance (4 V, 4 V).
    """
    views = len(fit.found)
    others = np.arange(views) != reference
    # Where most are misplaced, one that seems right is so by chance, and no measure for the others.
    are_few = 2 * int(is_misplaced.sum()) <= views - 1
    kinds = [others & is_misplaced, others & ~is_misplaced] if are_few else [others]
    floor = np.array([_SMALLEST_PX, _SMALLEST_PX / max(largest_px, 1e-3)]).repeat(2)
    found, covariance = fit.found, fit.covariance
    for _ in range(_SCALE_ROUNDS):
        spread = np.diag(covariance).reshape(views, UNKNOWNS) + found**2
        expected = np.tile(floor**2, (views, 1))
        for kind in kinds:
            if kind.any():
                of_kind = spread[kind].mean(axis=0).reshape(2, 2).mean(axis=1).repeat(2)
                expected[kind] = np.maximum(of_kind, floor**2)
        expected[reference] = (1e-3 * floor) ** 2
        covariance = _inverse(fit.information + np.diag(1.0 / expected.ravel()))
        found = (covariance @ fit.right).reshape(views, UNKNOWNS)
    return found, covariance


def slope_variance(lines: Lines, tilt: Float, moment: Float) -> Float:
    """What errors of places do to the slopes, (3,): 1, slope and slope^2 times these.

    Args:
        lines: where slopes are told.
        tilt: (N, V) what a change of each pixel's slope does to its grey values.
        moment: (4 V, 4 V) mean square of the errors.

    Returns:
        The variance of slopes is their polynomial, px^2 for slopes in px.
    """
    views = tilt.shape[1]
    known = (tilt**2).sum(axis=1)
    scaled = tilt / np.sqrt(np.maximum(known, 1e-12))[:, None]
    effects = np.stack([scaled * lines.across[:, None], scaled * lines.down[:, None]], axis=2)
    flat = effects.reshape(len(tilt), -1)
    share = (summed(flat, flat) / max(float(known.sum()), 1e-12)).reshape(views, 2, views, 2)
    blocks = moment.reshape(views, 2, 2, views, 2, 2)
    of = np.einsum("iajb,icajdb->cd", share, blocks)
    return np.array([of[0, 0], -of[0, 1] - of[1, 0], of[1, 1]])


def _held_out_gain(lines: Lines, solution: _Solution, prior: Float) -> Float:
    """By how many of its sigmas the misfit falls with the places that the other half tells, (V,).

    Of each view, the places of all the others being corrected; paired over the cells.
    """
    design, gain = lines.design, np.empty_like(lines.difference)
    for here, (normal, right) in zip(lines.halves, reversed(solution.parts), strict=True):
        found = np.linalg.solve(normal + prior, right).reshape(-1, UNKNOWNS)
        moved, known = design[here] @ found.T, solution.eliminated.part(here)
        left = known.rest(lines.difference[here] - moved)
        moved *= known.root
        alone = 1.0 - known.grey**2 - known.slope**2
        gain[here] = moved * (2.0 * left + moved * alone)
    of_cells = np.add.reduceat(gain, lines.cells)
    count = len(of_cells)
    sigma = of_cells.std(axis=0) / max(count - 1, 1) ** 0.5
    return of_cells.mean(axis=0) / np.maximum(sigma, 1e-12)


def _narrowed(weight: Float) -> float:
    """Slope of what a difference with such a weight pulls by, as a share of the weight.

    Doubt makes differences pull less than in proportion, which hides a part of their scatter (P.
    Huber, "Robust estimation of a location parameter", Ann. Math. Stat. 35, 1964).
    """
    return max(float((2.0 * weight**2 - weight).sum() / weight.sum()), _FEWEST_BELIEVED)


def _scatter_of_cells(left: Float, design: Float, cells: NDArray[np.intp]) -> Float:
    """How far the cells contradict each other, as a sum of squares (4 V, 4 V).

    Args:
        left: (N, V) what is unexplained, weighted.
        design: (N, 4) what the unknowns of a view do to its difference.
        cells: first pixel of every cell.
    """
    each = zip(np.split(left, cells[1:]), np.split(design, cells[1:]), strict=True)
    pulls = np.stack([(one.T @ by).ravel() for one, by in each])
    return pulls.T @ pulls * (len(pulls) / max(len(pulls) - 1, 1))


def _prior(x_steps: Float, y_steps: Float, reference: int, largest_px: float) -> Float:
    """Inverse covariance of the unknowns before anything is seen, (4 V, 4 V)."""
    views = len(x_steps)
    step = _EXPECTED_PX / max(largest_px, 1e-3)
    scale = np.tile([_EXPECTED_PX, _EXPECTED_PX, step, step], views)
    places = np.stack([x_steps, y_steps], axis=1)
    moves = [places]
    extent = np.linalg.svd(places, compute_uv=False)
    if extent[1] < _ON_A_LINE * extent[0]:
        moves.append(places[:, ::-1] * np.array([-1.0, 1.0]))
    unknown = np.zeros((len(moves), 2, views, UNKNOWNS))
    for k, move in enumerate(moves):
        unknown[k, 0, :, :2] = unknown[k, 1, :, 2:] = move
    held = unknown.reshape(2 * len(moves), -1) / scale
    held /= np.linalg.norm(held, axis=1, keepdims=True)
    prior = np.eye(len(scale)) + _HELD * held.T @ held
    fixed = slice(UNKNOWNS * reference, UNKNOWNS * (reference + 1))
    prior[fixed, fixed] += _HELD * np.eye(UNKNOWNS)
    return prior / np.outer(scale, scale)
