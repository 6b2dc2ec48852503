"""How board and stage stand against the optical axis, as the sweep itself shows it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.curve import BoardTilt, FieldFit, fit_field
from rig.optics.optics import Optics
from rig.sweep.points import StopResult

_FEWEST_DISTANCES = 3


@dataclass(frozen=True, slots=True)
class Angles:
    """Two small angles against the reference camera's optical axis, and their 1 sigma."""

    right_deg: float
    down_deg: float
    sigma_deg: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Alignment:
    """What there is to turn."""

    board: Angles | None
    """Positive: the board recedes towards the right, or downwards. None where unknown."""
    stage: Angles | None
    """Positive: the stage carries the board to the right, or downwards, as it goes away."""
    is_calibrated: bool
    """Whether the optical axis is known, or taken to pass the middle of the picture."""


def board_field(stops: Sequence[StopResult], optics: Optics) -> FieldFit | None:
    """Tell the tilt of the board from a field of the cameras; held-out stops take no part.

    None where too few stops show the tilt.
    """
    used = _used(stops)
    tilts = [
        BoardTilt(s.point.distance_mm, s.tilt, s.tilt_sigma)
        for s in used
        if s.point is not None and s.tilt is not None and s.tilt_sigma is not None
    ]
    centres = np.array([s.centre_px for s in used if s.centre_px is not None]).reshape(-1, 2)
    if not len(centres):
        return None
    middle_px = optics.axis_px
    if middle_px is None:
        across, down = centres.mean(axis=0).tolist()
        middle_px = (across, down)
    return fit_field(tilts, middle_px)


def measure_alignment(
    stops: Sequence[StopResult],
    optics: Optics,
    field: FieldFit | None,
    *,
    pitch_mm: float,
    focal_px: float | None,
) -> Alignment:
    """Measure how board and stage stand; held-out stops take no part.

    Args:
        stops: of the sweep.
        optics: what they were measured with.
        field: what `board_field` found.
        pitch_mm: view step of the rig.
        focal_px: focal length for rigs without a calibration; None leaves the stage unknown.
    """
    board = None if field is None else _board(field, optics, pitch_mm)
    stage = _stage(_used(stops), optics, focal_px)
    return Alignment(board, stage, optics.calibration_id is not None)


def _used(stops: Sequence[StopResult]) -> list[StopResult]:
    return [s for s in stops if s.point is not None and s.point.role == "fit"]


def _board(field: FieldFit, optics: Optics, pitch_mm: float) -> Angles:
    per_step = -np.array(field.tilt_mm) / pitch_mm
    rise = optics.reference_directions(per_step)
    sigma = np.array(field.tilt_sigma_mm) / pitch_mm
    right, down = np.degrees(np.arctan(rise)).tolist()
    first, second = np.degrees(sigma).tolist()
    return Angles(right, down, (first, second))


def _stage(stops: Sequence[StopResult], optics: Optics, focal_px: float | None) -> Angles | None:
    """Fit a straight way through the board's centres, (x, y) Z against Z."""
    places = [
        (s.point.distance_mm, optics.ray(s.centre_px, focal_px))
        for s in stops
        if s.point is not None and s.centre_px is not None
    ]
    rays = [(distance_mm, ray) for distance_mm, ray in places if ray is not None]
    if len({round(distance_mm, 1) for distance_mm, _ in rays}) < _FEWEST_DISTANCES:
        return None
    distance_mm = np.array([d for d, _ in rays])
    across_mm = distance_mm[:, None] * np.array([ray for _, ray in rays])
    # Centres are equally sure in the picture, so far ones are less so in mm.
    design = np.stack([np.ones_like(distance_mm), distance_mm], axis=1) / distance_mm[:, None]
    line, *_ = np.linalg.lstsq(design, across_mm / distance_mm[:, None])
    left = across_mm / distance_mm[:, None] - design @ line
    scatter = (left**2).sum(axis=0) / max(len(left) - 2, 1)
    variance = scatter * np.linalg.inv(design.T @ design)[1, 1]
    sigma = np.degrees(np.sqrt(variance + optics.axis_variance_rad2))
    right, down = np.degrees(np.arctan(line[1])).tolist()
    return Angles(right, down, (float(sigma[0]), float(sigma[1])))
