"""From sightings to a calibration: a pure function of what was found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rig.arrays import Float, Index
from rig.calibrate.light import lit_part
from rig.calibrate.sight import PictureSightings, all_sightings
from rig.errors import CalibrationError
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.observations import observe
from rig.geometry.bundle.part import Part
from rig.geometry.bundle.repeats import require_different_places
from rig.geometry.bundle.rolling_shutter import Readout, measure_readouts, readout_text
from rig.geometry.bundle.solve import Fixed
from rig.geometry.circle_bias import without_bias
from rig.geometry.half_turn import agree_on_turns
from rig.geometry.lens import LensModel
from rig.geometry.mirrored import refuse_mirrored
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from rig.profile import FolderCameraConfig, Profile
from rig.targets import CircleGrid, Target

_AT_ODDS = frozenset({"unsynchronised", "moved", "bumped", "swapped", "outliers"})
"""What views are suspected of that disagree about the board; mirrored pictures disagree too."""


_ROUNDS_OF_OUTLIERS = 10
_LEAST_KEPT = 0.5
"""Share of the points that a limit of outliers must leave."""
_ROUNDS_OF_CENTRES = 2
"""Solves after the first one, of circles."""


@dataclass(frozen=True, slots=True)
class SolveChoices:
    """How to solve."""

    lens: LensModel | Literal["auto"] = "auto"
    start: RigGeometry | None = None
    """Geometry to start from."""
    fixed: Fixed = "none"
    """What of it to keep."""
    outlier_px: float | None = None
    """Points further than this from where the calibration puts them are left out, and all is solved
    again; None leaves only those out that are beyond 5 sigma."""


def solve(
    profile: Profile, target: Target, pictures: Sequence[PictureSightings], choices: SolveChoices
) -> Calibration:
    """Solve cameras, their places, the target and the stage from all pictures.

    The same pictures give the same calibration to the last digit.

    Args:
        profile: the rig.
        target: what was looked for.
        pictures: pictures and what was found in them.
        choices: how to solve.

    Raises:
        CalibrationError: the pictures do not determine the geometry.
    """
    names = tuple(view.name for view in profile.views)
    sightings = all_sightings(pictures)
    if not sightings:
        raise CalibrationError(
            f"calibration of {profile.name} asked for, the target is in none of {len(pictures)} "
            "pictures",
            advice="show the target to the cameras",
        )
    board = _Board(
        target.points_mm.reshape(-1, 3), pictures[0].sizes_px, names, target.has_one_way_up
    )
    try:
        calibration = _solved(profile, board, sightings, pictures, choices)
        if isinstance(target, CircleGrid):
            calibration = _of_centres(
                calibration, target, profile, board, sightings, pictures, choices
            )
    except CalibrationError:
        board.refuse_mirrored(sightings)
        raise
    if _AT_ODDS.intersection(reason.code for reason in calibration.verdict.reasons):
        board.refuse_mirrored(sightings)
    told = [
        readout_text(calibration, readout)
        for readout in readouts_of(profile, pictures, calibration)
        if readout.is_rolling
    ]
    verdict = replace(calibration.verdict, notes=(*calibration.verdict.notes, *told))
    return replace(calibration, verdict=verdict)


def readouts_of(
    profile: Profile, pictures: Sequence[PictureSightings], calibration: Calibration
) -> tuple[Readout, ...]:
    """Return how long views take from their first row to their last, where boards moved.

    Pictures in folders have the time at which they were read: nobody knows when they were taken.
    """
    if isinstance(profile.camera, FolderCameraConfig):
        return ()
    times_s = {one.number: one.time_s for one in pictures if one.time_s is not None}
    return measure_readouts(calibration, times_s)


def without_far_points(
    sightings: Sequence[Sighting], calibration: Calibration, outlier_px: float
) -> tuple[Sighting, ...]:
    """Return sightings without the points that a calibration puts further away than a limit.

    Args:
        sightings: of the pictures that it was solved from.
        calibration: which says where points should be.
        outlier_px: largest distance that is kept.
    """
    far = {
        (r.picture, r.view): r.ids[np.linalg.norm(r.residual_px, axis=1) > outlier_px]
        for r in calibration.residuals
    }
    nothing = np.empty(0, np.intp)
    return tuple(_without(s, far.get((s.picture, s.view), nothing)) for s in sightings)


def _without(one: Sighting, gone: Index) -> Sighting:
    kept = ~np.isin(one.ids, gone)
    return replace(one, ids=one.ids[kept], xy_px=one.xy_px[kept], sigma_px=one.sigma_px[kept])


def _of_centres(
    first: Calibration,
    target: CircleGrid,
    profile: Profile,
    board: "_Board",
    sightings: Sequence[Sighting],
    pictures: Sequence[PictureSightings],
    choices: SolveChoices,
) -> Calibration:
    """Solve again until the middles of ellipses are corrected by the cameras that they lead to.

    The correction is a small part of a circle's diameter and hardly moves with the cameras: a
    second round changes it by a thousandth.
    """
    found = first
    for _ in range(_ROUNDS_OF_CENTRES):
        boards = dict(zip(found.pictures, found.reference_from_board, strict=True))
        centres = without_bias(
            board.one_way_up(sightings), found.geometry, boards, board.points_mm, target.diameter_mm
        )
        found = _solved(profile, board, centres, pictures, choices)
    return found


@dataclass(frozen=True, slots=True)
class _Board:
    """What the views look at, and how large their pictures are."""

    points_mm: Float
    sizes_px: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    has_one_way_up: bool

    def one_way_up(self, sightings: Sequence[Sighting]) -> Sequence[Sighting]:
        if self.has_one_way_up:
            return sightings
        require_different_places(observe(sightings, self.points_mm, len(self.names)))
        return agree_on_turns(sightings, self.points_mm, self.sizes_px, self.names)

    def refuse_mirrored(self, sightings: Sequence[Sighting]) -> None:
        refuse_mirrored(
            sightings,
            self.points_mm,
            self.sizes_px,
            self.names,
            has_one_way_up=self.has_one_way_up,
        )


def _solved(
    profile: Profile,
    board: _Board,
    sightings: Sequence[Sighting],
    pictures: Sequence[PictureSightings],
    choices: SolveChoices,
) -> Calibration:
    """Solve, and solve again without far points until none is left."""
    used = tuple(board.one_way_up(sightings))
    found = _solved_once(profile, board, used, pictures, choices)
    if choices.outlier_px is None:
        return found
    count = sum(map(len, used))
    for _ in range(_ROUNDS_OF_OUTLIERS):
        kept = without_far_points(used, found, choices.outlier_px)
        left = sum(map(len, kept))
        if left == sum(map(len, used)):
            break
        if left < _LEAST_KEPT * count:
            raise CalibrationError(
                f"points beyond {choices.outlier_px:g} px asked to be left out, that is "
                f"{count - left} of {count}",
                advice="choose a larger --outlier-px, or look at the pictures: most of them do "
                "not fit each other",
            )
        used = kept
        found = _solved_once(profile, board, used, pictures, choices)
    left = sum(map(len, used))
    note = (
        f"{count - left} of {count} points were left out, further than {choices.outlier_px:g} px "
        "from where they should be"
    )
    return replace(found, verdict=replace(found.verdict, notes=(*found.verdict.notes, note)))


def _solved_once(
    profile: Profile,
    board: _Board,
    sightings: Sequence[Sighting],
    pictures: Sequence[PictureSightings],
    choices: SolveChoices,
) -> Calibration:
    stage_mm = {
        one.number: one.stage_mm for one in pictures if one.stage_mm is not None and one.sightings
    }
    return solve_rig(
        sightings,
        board.points_mm,
        board.sizes_px,
        board.names,
        profile.reference,
        stage_mm=stage_mm or None,
        lens=choices.lens,
        start=choices.start,
        fixed=choices.fixed,
        steps=np.array([[view.x_steps, view.y_steps] for view in profile.views]),
        lit=_lit(pictures, profile.reference),
    )


def _lit(pictures: Sequence[PictureSightings], view: int) -> Part | None:
    looked = [one.brightness[view] for one in pictures if one.brightness]
    return lit_part(looked) if looked else None
