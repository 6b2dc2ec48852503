"""How sure the shared unknowns are: covariance from the solve, scaled to what pictures show."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.kernels import factorise
from rig.geometry.bundle.linearise import linearise
from rig.geometry.bundle.normal import Normal, Reduced, form, solve


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of the P shared unknowns, in the order of the layout."""

    covariance: Float
    """(P, P), scaled."""
    picture_information: Float
    """(N, P, P) what each picture alone adds to the inverse of the unscaled covariance."""
    scale: float
    """Variances are so many times those of independent errors with the weights' own sigma."""
    clustering: float
    """Variance of a picture's pull on the unknowns over that of independent points: 1 where the
    errors of one picture have nothing in common."""


def measure_uncertainty(adjusted: Adjusted) -> Uncertainty:
    """Invert the reduced normal equations and scale them by how pictures disagree.

    Errors of the points of one picture share causes (blur, light, a board that is not quite as
    modelled), so the points are fewer than they look. What each picture pulls at the solution,
    g_i, is compared with what independent errors would pull: sum g_i' C g_i over
    sum tr(C A_i - C A_i C A_i), the sandwich estimate of White ("A heteroskedasticity-consistent
    covariance matrix estimator", Econometrica 48, 1980) with pictures as clusters, reduced to one
    number because a few dozen pictures do not determine a matrix. It is never taken below that of
    independent errors.

    Raises:
        CalibrationError: the sightings do not determine all unknowns.
    """
    problem = adjusted.problem
    linear = linearise(problem.observed, problem.target, adjusted.at)
    normal = form(
        problem.observed, problem.target, adjusted.at, problem.layout,
        linear, adjusted.weight, problem.stops, problem.tie,
    )  # fmt: skip
    reduced = normal.reduced()
    inverse = solve(reduced.matrix, np.eye(problem.layout.count)) if reduced else None
    if reduced is None or inverse is None:
        raise CalibrationError(
            f"{len(problem.observed.pictures)} pictures do not determine the "
            f"{problem.layout.count} numbers of cameras, places and board",
            advice="take more pictures, tilted to all sides and at several distances",
        )
    information = picture_information(normal, reduced)
    pull = normal.side - np.einsum("nip,ni->np", reduced.between, reduced.pull)
    share = np.einsum("pq,nqr->npr", inverse, information)
    spread = float(np.einsum("np,pq,nq->", pull, inverse, pull))
    free = float(np.einsum("npp->", share) - np.einsum("npq,nqp->", share, share))
    point = _independent_scale(adjusted)
    clustering = spread / free / point if free > 0 else 1.0
    scale = point * max(clustering, 1.0)
    covariance = _symmetric(inverse) * scale
    if clustering > 1.0:
        covariance = _sandwich(inverse, share, pull / np.sqrt(scale)) * scale
    return Uncertainty(covariance, information, scale, clustering)


def _sandwich(inverse: Float, share: Float, pull: Float) -> Float:
    """(P, P) covariance that is wider where pictures disagree more, in units of `scale`.

    Whitened by the model's own covariance, pulls of pictures would have the unit matrix for their
    second moment. The one seen is freed of what the fit took (R. M. Bell, D. F. McCaffrey, "Bias
    reduction in standard errors for linear regression with multi-stage samples", Survey Methodology
    28(2), 2002) and shrunk towards a multiple of the unit matrix by as much as chance alone would
    spread it, because a few dozen pictures do not determine a matrix (O. Ledoit, M. Wolf, "A
    well-conditioned estimator for large-dimensional covariance matrices", J. Multivariate Analysis
    88(2), 2004).

    Args:
        inverse: (P, P) covariance of the model.
        share: (N, P, P) inverse times each picture's information.
        pull: (N, P) of each picture, over the root of the scale.
    """
    count, size = len(pull), len(inverse)
    root = inverse.copy()
    fitted = np.einsum("npq,nqr->pr", share, share)  # by the fit: C A C A, summed
    # Never all of a direction, which fewer pictures than unknowns would leave without a say.
    left = inverse - (1.0 - 1.0 / count) * _symmetric(np.einsum("pr,rq->pq", fitted, inverse))
    if not (factorise(root) and factorise(left)):
        return inverse
    root, left = np.tril(root), np.tril(left)
    # Steps that each picture alone would have the answer take, whitened by what is left of C.
    steps = np.einsum("np,pq->nq", pull, inverse).T.copy()
    _forward(left, steps)
    steps *= np.sqrt(count)
    moment = np.einsum("pn,qn->pq", steps, steps) / count
    mean = float(np.trace(moment)) / size
    apart = float(np.sum((moment - mean * np.eye(size)) ** 2))
    chance = float(np.sum(np.sum(steps**2, axis=0) ** 2) / count - np.sum(moment**2)) / count
    shrink = min(1.0, chance / apart) if apart > 0 else 1.0
    meat = shrink * max(mean, 1.0) * np.eye(size) + (1.0 - shrink) * moment
    return _symmetric(np.einsum("pi,ij,qj->pq", root, meat, root))


def _forward(lower: Float, sides: Float) -> None:
    """Replace sides (P, K) by L^-1 sides."""
    for i in range(len(sides)):
        sides[i] = (sides[i] - np.einsum("k,kc->c", lower[i, :i], sides[:i])) / lower[i, i]


def picture_information(normal: Normal, reduced: Reduced) -> Float:
    """(N, P, P) information of each picture about the shared unknowns, its pose eliminated."""
    between = reduced.between
    return normal.shared - np.einsum("nip,niq->npq", between, between)


def _independent_scale(adjusted: Adjusted) -> float:
    """Mean of weight^2 r^2 over mean of weight, per residual, freed of what the fit took."""
    weight = adjusted.weight
    used = weight > 0
    square = np.sum(adjusted.residual_px[used] ** 2, axis=1) / 2.0
    count = 2 * int(used.sum())
    fitted = adjusted.problem.layout.count + 6 * len(adjusted.problem.observed.pictures)
    fitted += adjusted.motion.dof if adjusted.motion else 0.0
    spare = count / max(count - fitted, 1)
    return float(np.sum(weight[used] ** 2 * square) / np.sum(weight[used])) * spare


def _symmetric(matrix: Float) -> Float:
    return (matrix + matrix.T) / 2
