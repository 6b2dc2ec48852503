"""How the views of a rig have turned since a calibration, look after look, with temperature."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np

from rig.geometry.bundle.geometry_of import rodrigues_by_turn
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_from_json
from rig.records import StoredCalibration, StoredDrift

MOST = 240
"""Looks that a picture of the series shows: two hours of a capture's; of longer ones every so
many-th, and always the newest."""
_PITCH, _ROLL = 0, 2
_POSE = 6


@dataclass(frozen=True, slots=True)
class DriftSeries:
    """Looks at scenes since one calibration."""

    calibration_id: int
    made_at: datetime
    temperature_degc: float | None
    """Of the camera when it was calibrated, where it told."""
    known_deg: dict[str, tuple[float, float]]
    """How sure the calibration is of pitch and roll of each view, 1 sigma; empty where it does not
    say."""
    looks: tuple[StoredDrift, ...]
    """Oldest first."""

    def joined(self, look: StoredDrift) -> "DriftSeries":
        """Return the series with one more look."""
        return replace(self, looks=(*self.looks, look))

    def to_json(self) -> dict[str, Any]:
        """Return what is drawn, as plain data: columns, of at most `MOST` looks.

        `views` holds of each view `known_deg` (pitch, roll; None where the calibration does not
        say), `turned_deg` and `sigma_deg` (pitch and roll of each look; None where a look does not
        tell of this view). Sigmas are 1 sigma.
        """
        every = -(-len(self.looks) // MOST) or 1
        shown = self.looks[::-1][::every][::-1]
        names = dict.fromkeys(
            name for look in shown for name in _angles(look, "turned_deg") if isinstance(name, str)
        )
        return {
            "calibration": self.calibration_id,
            "made_ms": 1e3 * self.made_at.timestamp(),
            "degc": self.temperature_degc,
            "looks": len(self.looks),
            "time_ms": [1e3 * look.measured_at.timestamp() for look in shown],
            "look_degc": [look.temperature_degc for look in shown],
            "probability": [look.details.get("probability") for look in shown],
            "views": {
                name: {
                    "known_deg": self.known_deg.get(name),
                    "turned_deg": [_pitch_roll(look, "turned_deg", name) for look in shown],
                    "sigma_deg": [_pitch_roll(look, "sigma_deg", name) for look in shown],
                }
                for name in names
            },
        }


def drift_series(calibration: StoredCalibration, looks: Iterable[StoredDrift]) -> DriftSeries:
    """Return the looks that were compared with a calibration.

    Args:
        calibration: of cameras, not of lenslets.
        looks: of any rigs, oldest first; those of this calibration are taken.
    """
    return DriftSeries(
        calibration.id,
        calibration.created_at,
        calibration.temperature_degc,
        _known_deg(geometry_from_json(calibration.geometry)),
        tuple(look for look in looks if look.calibration_id == calibration.id),
    )


def _known_deg(geometry: RigGeometry) -> dict[str, tuple[float, float]]:
    """Pitch and roll of each view but the reference, 1 sigma, about its own axes."""
    if geometry.covariance is None:
        return {}
    found: dict[str, tuple[float, float]] = {}
    at = geometry.parameter_count - _POSE * (len(geometry.names) - 1)
    for view, (name, place) in enumerate(
        zip(geometry.names, geometry.cam_from_reference, strict=True)
    ):
        if view == geometry.reference:
            continue
        by_vector = np.linalg.inv(rodrigues_by_turn(place.rotation_rad))
        turns = by_vector @ geometry.covariance[at : at + 3, at : at + 3] @ by_vector.T
        pitch_deg, _, roll_deg = np.degrees(np.sqrt(np.maximum(np.diag(turns), 0.0))).tolist()
        found[name] = pitch_deg, roll_deg
        at += _POSE
    return found


def _angles(look: StoredDrift, name: str) -> dict[Any, Any]:
    """Angles of a look by view; none where what is stored is something else."""
    found: Any = look.details.get(name)
    return dict(found) if isinstance(found, dict) else {}


def _pitch_roll(look: StoredDrift, name: str, view: str) -> list[float] | None:
    angles: Any = _angles(look, name).get(view)
    if not isinstance(angles, list | tuple) or len(angles) <= _ROLL:  # pyright: ignore[reportUnknownArgumentType]
        return None
    pitch, roll = angles[_PITCH], angles[_ROLL]
    return [pitch, roll] if isinstance(pitch, float) and isinstance(roll, float) else None
