"""How board and stage stand against the optical axis, as the sweep itself shows it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.curve import BoardTilt, FieldFit, fit_field
from rig.optics.rectifier import Rectifier
from rig.sweep.points import StopResult

_FEWEST_DISTANCES = 3
_LITTLE_DEG = 0.05
"""Angles below which nothing needs to be turned: a cosine error of 4e-7."""


@dataclass(frozen=True, slots=True)
class Angles:
    """Two small angles against the reference camera's optical axis, and their 1 sigma."""

    right_deg: float
    down_deg: float
    sigma_deg: tuple[float, float]

    def as_dict(self) -> dict[str, object]:
        """Return the angles for the command line's JSON."""
        return {
            "right_deg": self.right_deg,
            "down_deg": self.down_deg,
            "sigma_deg": list(self.sigma_deg),
        }


@dataclass(frozen=True, slots=True)
class Alignment:
    """What there is to turn."""

    board: Angles | None
    """Positive: the board recedes towards the right, or downwards. None where unknown."""
    stage: Angles | None
    """Positive: the stage carries the board to the right, or downwards, as it goes away."""
    is_calibrated: bool
    """Whether the optical axis is known, or taken to pass the middle of the picture."""

    def as_dict(self) -> dict[str, object]:
        """Return the alignment for the command line's JSON."""
        return {
            "board": None if self.board is None else self.board.as_dict(),
            "stage": None if self.stage is None else self.stage.as_dict(),
            "calibrated": self.is_calibrated,
        }

    def lines(self) -> list[str]:
        """Say for a person what to turn, and by how much."""
        lines: list[str] = []
        if self.board is not None:
            lines.append(
                "board: "
                + _said(self.board, "right side", "lower side", "farther", "nearer")
                + _advice(self.board, "turn it back by as much to stand square to the axis")
            )
        if self.stage is not None:
            middle = "" if self.is_calibrated else ", if that passes the middle of the picture"
            lines.append(
                "stage: moving away it goes "
                + _directions(self.stage)
                + f" of the optical axis{middle}"
                + _advice(self.stage, "turn it back by as much to run along the axis")
            )
        return lines


def board_field(stops: Sequence[StopResult], rectifier: Rectifier) -> FieldFit | None:
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
    middle_px = rectifier.axis_px
    if middle_px is None:
        across, down = centres.mean(axis=0).tolist()
        middle_px = (across, down)
    return fit_field(tilts, middle_px)


def measure_alignment(
    stops: Sequence[StopResult],
    rectifier: Rectifier,
    field: FieldFit | None,
    focal_px: float | None,
) -> Alignment:
    """Measure how board and stage stand; held-out stops take no part.

    Args:
        stops: of the sweep.
        rectifier: what they were measured with.
        field: what `board_field` found.
        focal_px: focal length for rigs without a calibration; None leaves the stage unknown.
    """
    board = None if field is None else _board(field, rectifier)
    stage = _stage(_used(stops), rectifier, focal_px)
    return Alignment(board, stage, rectifier.rectification is not None)


def _used(stops: Sequence[StopResult]) -> list[StopResult]:
    return [s for s in stops if s.point is not None and s.point.role == "fit"]


def _board(field: FieldFit, rectifier: Rectifier) -> Angles:
    per_step = -np.array(field.tilt_mm) / rectifier.profile.pitch_mm
    rise = rectifier.reference_directions(per_step)
    sigma = np.array(field.tilt_sigma_mm) / rectifier.profile.pitch_mm
    right, down = np.degrees(np.arctan(rise)).tolist()
    first, second = np.degrees(sigma).tolist()
    return Angles(right, down, (first, second))


def _stage(
    stops: Sequence[StopResult], rectifier: Rectifier, focal_px: float | None
) -> Angles | None:
    """Fit a straight way through the board's centres, (x, y) Z against Z."""
    places = [
        (s.point.distance_mm, rectifier.ray(s.centre_px, focal_px))
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
    found, *_ = np.linalg.lstsq(design, across_mm / distance_mm[:, None])
    left = across_mm / distance_mm[:, None] - design @ found
    scatter = (left**2).sum(axis=0) / max(len(left) - 2, 1)
    variance = scatter * np.linalg.inv(design.T @ design)[1, 1]
    sigma = np.degrees(np.sqrt(variance + rectifier.axis_variance_rad2))
    right, down = np.degrees(np.arctan(found[1])).tolist()
    return Angles(right, down, (float(sigma[0]), float(sigma[1])))


def _said(angles: Angles, right: str, down: str, more: str, less: str) -> str:
    parts = [
        f"{side} {abs(angle):.2f} +- {2.0 * sigma:.2f} deg {more if angle > 0 else less}"
        for side, angle, sigma in (
            (right, angles.right_deg, angles.sigma_deg[0]),
            (down, angles.down_deg, angles.sigma_deg[1]),
        )
    ]
    return " and ".join(parts) + " (k=2)"


def _directions(angles: Angles) -> str:
    return (
        f"{abs(angles.right_deg):.2f} +- {2.0 * angles.sigma_deg[0]:.2f} deg "
        f"{'right' if angles.right_deg > 0 else 'left'} and {abs(angles.down_deg):.2f} +- "
        f"{2.0 * angles.sigma_deg[1]:.2f} deg {'below' if angles.down_deg > 0 else 'above'} (k=2)"
    )


def _advice(angles: Angles, what: str) -> str:
    pairs = zip((angles.right_deg, angles.down_deg), angles.sigma_deg, strict=True)
    worth = any(abs(angle) > max(_LITTLE_DEG, 2.0 * sigma) for angle, sigma in pairs)
    return f"; {what}" if worth else "; nothing to turn"
