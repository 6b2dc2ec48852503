"""Good, or weak and why."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.advice import advise
from rig.geometry.bundle.coverage import find_gaps
from rig.geometry.bundle.direction_error import direction_error
from rig.geometry.bundle.motion import Motion
from rig.geometry.bundle.part import part_with_boards
from rig.geometry.bundle.repeats import repeated
from rig.geometry.bundle.result import DepthError, Reason, Verdict
from rig.geometry.bundle.suspicion import find_bad_data
from rig.geometry.bundle.uncertainty import Uncertainty
from rig.geometry.rig_geometry import RigGeometry

MOST_DEPTH_PCT = 0.2
"""Depth error at 1 m, k = 2 where boards were seen, above which a calibration is weak."""
MOST_DIRECTION_PX = 0.5
"""Error of directions of one camera alone, k = 2 where boards were seen: what undistorted pictures
of it are looked at with. Twenty pictures whose corners scatter by 0.1 px stay below."""
_JUDGED_MM = 1000.0
_MOST_CLUSTERING = 4.0
_MOST_OUTLIERS = 0.02


def judge(
    adjusted: Adjusted,
    uncertainty: Uncertainty,
    geometry: RigGeometry,
    depth_error: Sequence[DepthError],
    steps: NDArray[np.float64] | None,
) -> Verdict:
    """Collect what speaks against a calibration: bad data, then gaps, then what they come to.

    Args:
        adjusted: the solve.
        uncertainty: its covariance.
        geometry: what it found.
        depth_error: the headline; none where it cannot be told.
        steps: (V, 2) where the profile places the views, if it is known.
    """
    reasons = repeated(adjusted.problem.observed)
    reasons += find_bad_data(adjusted, geometry, steps)
    reasons += _outliers(adjusted)
    if not reasons and uncertainty.clustering > _MOST_CLUSTERING:
        reasons.append(
            Reason(
                "model",
                f"pictures disagree {np.sqrt(uncertainty.clustering):.1f} times as much as their "
                "points' noise allows: something is not modelled, such as focus that moves, a "
                "board that bends, or a rolling shutter",
            )
        )
    reasons += find_gaps(adjusted, geometry)
    reasons += _depth(depth_error)
    if len(geometry.names) == 1:
        reasons += _directions(adjusted, geometry)
    full = uncertainty.covariance.shape[0] >= geometry.parameter_count
    poses = advise(adjusted, uncertainty, geometry) if full and len(geometry.names) > 1 else ()
    notes = _notes(geometry, steps) + _motion(adjusted.motion)
    return Verdict(tuple(reasons), tuple(notes), poses)


def _outliers(adjusted: Adjusted) -> list[Reason]:
    share = float(np.mean(adjusted.weight == 0.0))
    if share <= _MOST_OUTLIERS:
        return []
    return [
        Reason(
            "outliers",
            f"{100 * share:.1f} % of the points do not fit and were left out; look at the pictures "
            "with most of them",
        )
    ]


def _depth(depth_error: Sequence[DepthError]) -> list[Reason]:
    at = next((error for error in depth_error if error.distance_mm == _JUDGED_MM), None)
    if at is None or not at.seen_pct > MOST_DEPTH_PCT:
        return []
    return [
        Reason(
            "depth-error",
            f"depth at {_JUDGED_MM / 1000:g} m is only known to {at.seen_pct:.2f} % (k=2, where "
            f"boards were seen; {MOST_DEPTH_PCT} % wanted); take more pictures",
        )
    ]


def _directions(adjusted: Adjusted, geometry: RigGeometry) -> list[Reason]:
    """What one camera alone is judged by."""
    if geometry.covariance is None:
        return []
    camera = geometry.cameras[0]
    size_px = camera.width_px, camera.height_px
    seen = part_with_boards(adjusted.problem.observed, 0, size_px, adjusted.weight > 0)
    error = direction_error(geometry, seen)
    if not error.seen_px > MOST_DIRECTION_PX:
        return []
    return [
        Reason(
            "direction-error",
            f"directions are only known to {error.seen_px:.2f} px (k=2, where boards were seen; "
            f"{MOST_DIRECTION_PX} px wanted); take more pictures",
        )
    ]


def _motion(motion: Motion | None) -> list[str]:
    if motion is None:
        return []
    turn_deg, shift_mm = float(np.degrees(motion.sigma[0])), float(motion.sigma[1])
    return [
        f"the board moved between the views of a picture, typically by {shift_mm:.2g} mm and "
        f"{turn_deg:.2g} deg (1 sigma; {motion.picture_scale.max():.1f} times that in the worst): "
        "each view has its own pose of the board, and places of the cameras are as unsure as that "
        "makes them; with views triggered together, or the board at rest, they would be surer"
    ]


def _notes(geometry: RigGeometry, steps: NDArray[np.float64] | None) -> list[str]:
    notes: list[str] = []
    if geometry.stage is None and len(geometry.names) > 1:
        notes.append(
            "no stage took part: all lengths rest on the size of the squares, and a board printed "
            "at another scale cannot be noticed"
        )
    if steps is None and len(geometry.names) > 1:
        notes.append("places of the views were not given: exchanged views cannot be noticed")
    return notes
