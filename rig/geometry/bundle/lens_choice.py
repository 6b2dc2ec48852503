"""Which lens model predicts unseen pictures best."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from rig.arrays import Float
from rig.geometry.bundle.result import LensScore
from rig.geometry.bundle.unknowns import Unknowns
from rig.geometry.lens import COEFFICIENTS, LensModel, distort

SIMPLEST_FIRST: tuple[LensModel, ...] = ("brown5", "fisheye", "brown8")
"""A later model must be better than an earlier one by more than chance; the rational one can bend
outside the pictures that taught it, so it comes last."""
_STANDARD_ERRORS = 2.0
_TRIFLE = 0.01
"""Share of the mean square that is not worth another model, however sure it is."""
_GRID = 15


def score_lenses(squares_px2: Sequence[tuple[LensModel, Float]]) -> tuple[LensScore, ...]:
    """Compare models picture by picture; robust against a few bad pictures.

    Args:
        squares_px2: models, each with (N,) held-out mean squares of the pictures, NaN for none.

    Returns:
        Scores in the order given; the best one is worse than itself by 0.
    """
    best = min(
        (square for _, square in squares_px2), key=lambda square: float(np.nanmedian(square))
    )
    scores: list[LensScore] = []
    for lens, square in squares_px2:
        apart = square - best
        apart = apart[np.isfinite(apart)]
        worse = float(np.median(apart)) if apart.size else float("inf")
        spread = float(np.median(np.abs(apart - worse))) if apart.size else 0.0
        # Standard error of a median of normal differences, spread told by their median deviation.
        sem = 1.2533 * 1.4826 * spread / np.sqrt(max(apart.size, 1))
        scores.append(LensScore(lens, float(np.sqrt(np.nanmedian(square))), worse, float(sem)))
    return tuple(scores)


def choose_lens(scores: Sequence[LensScore]) -> LensModel:
    """Return the first, simplest model that the best one beats by chance or by a trifle only."""
    best = min(scores, key=lambda score: score.rms_px)
    trifle_px2 = _TRIFLE * best.rms_px**2
    good = (
        score
        for score in scores
        if score.worse_px2 <= max(_STANDARD_ERRORS * score.sem_px2, trifle_px2)
    )
    return next(good, best).lens


def with_lens(at: Unknowns, lens: LensModel, sizes_px: Sequence[tuple[int, int]]) -> Unknowns:
    """Return a start with another lens model that maps every view as nearly alike as it can."""
    views = range(len(at.lenses))
    numbers = tuple(_refit(at.lenses[v], at.intrinsics[v], lens, sizes_px[v]) for v in views)
    return replace(at, lenses=(lens,) * len(at.lenses), intrinsics=numbers)


def _refit(old: LensModel, numbers: Float, new: LensModel, size_px: tuple[int, int]) -> Float:
    """Intrinsics of the new model, by least squares over the picture."""
    half = np.array(size_px) / (2 * numbers[:2])
    if old == "fisheye":
        half = np.tan(np.minimum(half, 1.2))
    x, y = np.meshgrid(*(np.linspace(-h, h, _GRID) for h in half))
    xy = np.stack([x.ravel(), y.ravel()], axis=1)
    wanted = _pixels(old, numbers, xy)

    def apart(values: Float) -> Float:
        return (_pixels(new, values, xy) - wanted).ravel()

    start = np.concatenate([numbers[:4], np.zeros(COEFFICIENTS[new])])
    shared = min(COEFFICIENTS[old], COEFFICIENTS[new])
    if old.startswith("brown") and new.startswith("brown"):
        start[4 : 4 + shared] = numbers[4 : 4 + shared]
    by: Callable[[Float], Float] = lambda values: _by_numbers(new, values, xy)  # noqa: E731
    return np.asarray(least_squares(apart, start, by, x_scale="jac", method="trf").x, np.float64)


def _pixels(lens: LensModel, numbers: Float, xy: Float) -> Float:
    return distort(lens, numbers[4:], xy).xy * numbers[:2] + numbers[2:4]


def _by_numbers(lens: LensModel, numbers: Float, xy: Float) -> Float:
    bent = distort(lens, numbers[4:], xy)
    jacobian = np.zeros((len(xy), 2, len(numbers)))
    jacobian[:, 0, 0], jacobian[:, 1, 1] = bent.xy.T
    jacobian[:, 0, 2] = jacobian[:, 1, 3] = 1.0
    jacobian[:, :, 4:] = bent.by_coefficients * numbers[:2, None]
    return jacobian.reshape(-1, len(numbers))
