"""Where each view alone would put the board: what synchronous views at rest agree about."""

from dataclasses import dataclass, replace

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.normal import form
from rig.geometry.bundle.rotations import apply, cross_matrix, times, turn_between
from rig.geometry.bundle.scatter import measure_scatter, point_weights
from rig.geometry.bundle.settle import settle
from rig.geometry.bundle.unknowns import Free, lay_out

_STEPS = 10


@dataclass(frozen=True, slots=True)
class Alone:
    """Every sighting with a pose of the board of its own; S sightings, V views."""

    motion: Float
    """(S, 6) from the common pose to its own, as a motion of the reference frame: turn (rad) about
    its origin and shift (mm). A camera that stands elsewhere than believed gives the same motion in
    every picture."""
    information: Float
    """(S, 6, 6) inverse covariance of `motion`, for the larger noise of the view's and the
    sighting's."""
    noise_ratio: Float
    """(S,) noise of the points about the own pose over that of the view."""
    noise_px: Float
    """(V,) noise of a typical point, per coordinate."""
    scatter_px: Float
    """(S,) the same of a typical point of a sighting."""


def fit_alone(adjusted: Adjusted) -> Alone:
    """Fit the board's pose to each sighting by itself, cameras and places fixed.

    The noise is that about the own pose: a view that is late or has been moved disagrees with the
    others, but is no less sharp in itself.
    """
    problem, at = adjusted.problem, adjusted.at
    observed = problem.observed
    count, views = len(observed.view), len(at.lenses)
    single = replace(
        observed, pictures=tuple(range(count)), picture=np.arange(count, dtype=np.int64)
    )
    layout = lay_out(at.lenses, 0, Free(*[False] * 5), stage=False)
    common = replace(
        at,
        board_rotation=at.board_rotation[observed.picture],
        board_shift_mm=at.board_shift_mm[observed.picture],
        stage=None,
        motion=None,
    )
    each = replace(problem, observed=single, layout=layout, stops=None, tie=None)
    rough, linear = settle(each, common, observed.sigma_px**-2.0, _STEPS)
    weight = point_weights(measure_scatter(single, linear.residual_px, views), reject=True)
    own, linear = settle(each, rough, weight, _STEPS)
    scatter = measure_scatter(single, linear.residual_px, views)
    view_of = observed.view[observed.sighting_of_point]
    told_px = np.hypot(observed.sigma_px, scatter.floor_px[view_of])
    even = (told_px * scatter.view_scale[view_of]) ** -2.0
    pose = form(single, problem.target, own, layout, linear, even, None).pose
    pivot = common.board_shift_mm
    turn = turn_between(own.board_rotation, common.board_rotation)
    shift = own.board_shift_mm - pivot + apply(cross_matrix(pivot), turn)
    # The board turns about its own origin, the frame about that of the reference view.
    board_by_frame = np.broadcast_to(np.eye(6), (count, 6, 6)).copy()
    board_by_frame[:, 3:, :3] = -cross_matrix(pivot)
    own_noise = np.maximum(scatter.sighting_scale, 1.0)[:, None, None] ** 2
    return Alone(
        motion=np.concatenate([turn, shift], axis=1),
        information=times(np.swapaxes(board_by_frame, 1, 2), times(pose, board_by_frame))
        / own_noise,
        noise_ratio=scatter.sighting_scale,
        noise_px=np.array([_median(scatter.sigma_px[view_of == view]) for view in range(views)]),
        scatter_px=np.array([_median(scatter.sigma_px[single.points(n)]) for n in range(count)]),
    )


def _median(values: Float) -> float:
    return float(np.median(values)) if values.size else float("nan")
