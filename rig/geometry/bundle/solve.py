"""The entry point: from sightings of a board to the geometry of the rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from rig.arrays import Float
from rig.compute.bands import run_side_by_side
from rig.errors import ConfigError
from rig.geometry.bundle.adjust import Adjusted, adjust, readjust
from rig.geometry.bundle.depth_error import depth_errors
from rig.geometry.bundle.epipolar import epipolar_error
from rig.geometry.bundle.geometry_of import (
    boards_of,
    cameras_of,
    places_of,
    rodrigues_by_shared,
    stage_geometry,
)
from rig.geometry.bundle.hold_out import held_out_residuals, picture_squares_px2
from rig.geometry.bundle.lens_choice import (
    SIMPLEST_FIRST,
    choose_lens,
    score_lenses,
    with_lens,
)
from rig.geometry.bundle.linearise import Target
from rig.geometry.bundle.observations import Observations, observe
from rig.geometry.bundle.part import Part, part_with_boards
from rig.geometry.bundle.priors import StageStops
from rig.geometry.bundle.repeats import require_different_places
from rig.geometry.bundle.result import (
    BoardMotion,
    BoardWarp,
    Calibration,
    LensScore,
    Residuals,
)
from rig.geometry.bundle.start import guess, start_from
from rig.geometry.bundle.uncertainty import Uncertainty, measure_uncertainty
from rig.geometry.bundle.unknowns import Free, Unknowns
from rig.geometry.bundle.verdict import judge
from rig.geometry.lens import LensModel
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

Fixed = Literal["none", "intrinsics", "all"]
"""What of `start` is kept: nothing, the cameras' intrinsics, or the extrinsics as well."""


@dataclass(frozen=True, slots=True)
class _Question:
    """What is asked, checked and ordered."""

    observed: Observations
    target: Target
    sizes_px: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    reference: int
    stops: StageStops | None
    free: Free


def solve_rig(
    sightings: Sequence[Sighting],
    points_mm: Float,
    sizes_px: Sequence[tuple[int, int]],
    names: Sequence[str],
    reference: int,
    *,
    stage_mm: Mapping[int, float] | None = None,
    lens: LensModel | Literal["auto"] = "auto",
    start: RigGeometry | None = None,
    fixed: Fixed = "none",
    steps: Float | None = None,
    synchronous: bool = False,
    lit: Part | None = None,
) -> Calibration:
    """Solve cameras, their places, the board and the stage together.

    Args:
        sightings: what was found, at most one per picture and view, in any order.
        points_mm: (P, 3) points of the flat target, z = 0.
        sizes_px: (width, height) of each view.
        names: of each view, for messages.
        reference: index of the view whose frame all places are told in.
        stage_mm: driver position of the pictures in which the stage carried the board; these
            share one orientation of the board.
        lens: model of all views, or `auto` to choose by cross-validation over pictures.
        start: geometry to start from instead of one found from the sightings.
        fixed: what of `start` to keep; its lens models then stay as they are.
        steps: (V, 2) where the profile places the views, right and down, in any unit; only their
            directions are compared with what is found.
        synchronous: views are known to be exposed together: no motion of the board between them is
            looked for.
        lit: where light falls on the picture of the reference view; None for all of it.

    Raises:
        CalibrationError: the sightings do not determine the geometry.
        ConfigError: arguments contradict each other.
    """
    question = _ask(sightings, points_mm, sizes_px, names, reference, stage_mm, start, fixed)
    question = replace(question, free=replace(question.free, motion=not synchronous))
    first = _first(question, lens, start, fixed)
    adjusted, held_out, scores = _choose(question, first, lens if fixed == "none" else None)
    uncertainty = measure_uncertainty(adjusted)
    geometry = _geometry(question, adjusted, uncertainty, start)
    residuals = _residuals(adjusted, held_out)
    seen = part_with_boards(question.observed, reference, sizes_px[reference], adjusted.weight > 0)
    tells_depth = geometry.covariance is not None and len(names) > 1
    errors = depth_errors(geometry, seen, lit) if tells_depth else ()
    warp_sigma = np.sqrt(np.diag(uncertainty.covariance)[adjusted.problem.layout.warp_columns])
    return Calibration(
        geometry=geometry,
        points_mm=question.target.points_mm,
        warp=BoardWarp(
            adjusted.at.warp_mm, warp_sigma, question.target.centre_mm, question.target.half_mm
        ),
        pictures=question.observed.pictures,
        reference_from_board=boards_of(adjusted.at),
        motion=_motion(adjusted),
        residuals=residuals,
        epipolar=epipolar_error(geometry, residuals),
        lens=geometry.cameras[reference].lens,
        lens_scores=scores,
        depth_error=errors,
        error_scale=max(uncertainty.clustering, 1.0),
        verdict=judge(adjusted, uncertainty, geometry, errors, steps),
    )


def _ask(
    sightings: Sequence[Sighting],
    points_mm: Float,
    sizes_px: Sequence[tuple[int, int]],
    names: Sequence[str],
    reference: int,
    stage_mm: Mapping[int, float] | None,
    start: RigGeometry | None,
    fixed: Fixed,
) -> _Question:
    points = np.ascontiguousarray(points_mm, np.float64).reshape(-1, 3)
    if np.abs(points[:, 2]).max(initial=0.0) > 0.0:
        raise ConfigError(
            f"target with points up to {np.abs(points[:, 2]).max():.3g} mm off its plane given",
            advice="calibration takes flat targets, z = 0, and finds the bending itself",
        )
    if len(sizes_px) != len(names) or not 0 <= reference < len(names):
        raise ConfigError(
            f"{len(names)} names, {len(sizes_px)} picture sizes and reference {reference} given",
            advice="give one of each per view and the reference among them",
        )
    if fixed != "none" and start is None:
        raise ConfigError(
            f"{fixed} asked to be fixed without a geometry to start from",
            advice="give one, or leave it free",
        )
    if start is not None and (len(start.names) != len(names) or start.reference != reference):
        raise ConfigError(
            f"{len(names)} views with reference {reference} given, the geometry to start from has "
            f"{len(start.names)} with reference {start.reference}",
            advice="give the geometry of this rig",
        )
    observed = observe(sightings, points, len(names))
    if fixed == "none":
        require_different_places(observed)
    free = Free(intrinsics=fixed == "none", lens=fixed == "none", places=fixed != "all")
    return _Question(
        observed=observed,
        target=Target(points),
        sizes_px=tuple(sizes_px),
        names=tuple(names),
        reference=reference,
        stops=_stops(observed, stage_mm or {}),
        free=free,
    )


def _stops(observed: Observations, stage_mm: Mapping[int, float]) -> StageStops | None:
    """Pictures on the stage; None for fewer than three positions, which make no line."""
    on = [(i, stage_mm[n]) for i, n in enumerate(observed.pictures) if n in stage_mm]
    if not stage_mm:
        return None
    positions = np.array([position for _, position in on], np.float64)
    if len(np.unique(positions)) < 3:
        raise ConfigError(
            f"stage with {len(stage_mm)} positions given, the board was found at "
            f"{len(np.unique(positions))} different ones",
            advice="at least 3 make a line",
        )
    return StageStops(np.array([index for index, _ in on], np.int64), positions)


def _first(
    question: _Question, lens: LensModel | Literal["auto"], start: RigGeometry | None, fixed: Fixed
) -> Adjusted:
    q = question
    if start is None:
        model: LensModel | None = None if lens == "auto" else lens
        at = guess(q.observed, q.target, q.sizes_px, q.names, q.reference, model)
        return adjust(q.observed, q.target, at, q.reference, q.stops, q.free)
    at = start_from(q.observed, q.target, start)
    if lens != "auto" and fixed == "none":
        at = with_lens(at, lens, q.sizes_px)
    return adjust(q.observed, q.target, at, q.reference, q.stops, q.free)


def _choose(
    question: _Question, first: Adjusted, lens: LensModel | Literal["auto"] | None
) -> tuple[Adjusted, Float, tuple[LensScore, ...]]:
    """Solve with every candidate, from the first solution, and keep the one that predicts best.

    Where a first lens explains all views by boards at rest, the others are compared with boards at
    rest as well: a motion that only another lens sees is most likely its misfit. Whichever is kept
    is asked for motions again.
    """
    own = first.at.lenses[question.reference]
    models = SIMPLEST_FIRST if lens == "auto" else (own,)
    free = replace(question.free, motion=question.free.motion and first.motion is not None)
    at_rest = replace(question, free=free)

    def judged(model: LensModel) -> tuple[Adjusted, Float]:
        solved = first if model == own else _with(at_rest, first.at, model)
        return solved, held_out_residuals(solved)

    tried = dict(zip(models, run_side_by_side(*(partial(judged, m) for m in models)), strict=True))
    scores = score_lenses([(model, picture_squares_px2(*both)) for model, both in tried.items()])
    best, held_out = tried[choose_lens(scores)]
    if question.free.motion and best is not first and best.motion is None:
        q = question
        asked = readjust(q.observed, q.target, best.at, q.reference, q.stops, q.free)
        if asked.motion is not None:
            best, held_out = asked, held_out_residuals(asked)
    return best, held_out, scores


def _with(question: _Question, near: Unknowns, lens: LensModel) -> Adjusted:
    q = question
    start = with_lens(near, lens, q.sizes_px)
    return readjust(q.observed, q.target, start, q.reference, q.stops, q.free)


def _geometry(
    question: _Question, adjusted: Adjusted, uncertainty: Uncertainty, start: RigGeometry | None
) -> RigGeometry:
    at, layout = adjusted.at, adjusted.problem.layout
    bare = RigGeometry(
        names=question.names,
        reference=question.reference,
        cameras=cameras_of(at, question.sizes_px),
        cam_from_reference=places_of(at),
        stage=stage_geometry(at.stage, question.target, layout, uncertainty.covariance)
        if at.stage is not None
        else None,
    )
    given = start.covariance if start is not None else None
    if not question.free.places:
        return replace(bare, covariance=given)
    count = bare.parameter_count
    own = count if question.free.intrinsics else 6 * (len(question.names) - 1)
    turned = rodrigues_by_shared(bare)[-own:, -own:]
    covariance = np.zeros((count, count))
    covariance[-own:, -own:] = turned @ uncertainty.covariance[:own, :own] @ turned.T
    if own < count and given is not None:
        covariance[:-own, :-own] = given[:-own, :-own]
    return replace(bare, covariance=covariance)


def _motion(adjusted: Adjusted) -> BoardMotion | None:
    motion = adjusted.motion
    if motion is None:
        return None
    turn_rad, shift_mm = map(float, motion.sigma)
    return BoardMotion(turn_rad, shift_mm, motion.picture_scale)


def _residuals(adjusted: Adjusted, held_out: Float) -> tuple[Residuals, ...]:
    observed = adjusted.problem.observed
    return tuple(
        Residuals(
            picture=observed.pictures[observed.picture[s]],
            view=int(observed.view[s]),
            ids=observed.ids[rows].astype(np.intp),
            xy_px=observed.xy_px[rows],
            residual_px=adjusted.residual_px[rows],
            sigma_px=adjusted.scatter.sigma_px[rows],
            outlier=adjusted.weight[rows] == 0.0,
            held_out_px=held_out[rows],
        )
        for s, rows in ((s, observed.points(s)) for s in range(len(observed.view)))
    )
