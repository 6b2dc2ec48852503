"""Judgement of the cameras by an ordinary scene: have views turned since their calibration?

Rows tell pitch and roll of a view. How far views have turned towards each other they hardly tell,
and depth hangs on that: its change is an interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.check.items import Item, Status, graded
from rig.epipolar.scene.drift import SceneDrift, scene_drift
from rig.epipolar.scene.look import look
from rig.epipolar.scene.motion import Before, before
from rig.frames import MultiView
from rig.geometry.rig_geometry_json import geometry_from_json
from rig.optics.prior import PRIOR_SIGMAS, UNKNOWN_SOURCE, prior_covariance
from rig.profile import Profile
from rig.records import StoredCalibration

CHANCE = 1e-4
"""Probability below which rows that lie elsewhere are no chance: one check in ten thousand."""
_MUCH_PX = 0.3
"""Rows that moved by more cost slopes more than their search forgives."""
_VAGUE_PCT = 2.0
"""Half an interval of the depth error that says nothing."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A multi-view of a scene, and the one before."""

    views: MultiView
    earlier: MultiView | None = None
    """Taken shortly before; None where there is none, as of stored pictures."""

    def before(self, reference: int) -> Before | None:
        """Return what the reference showed before, where things that move would matter."""
        if self.earlier is None:
            return None
        was, now = self.earlier.frames[reference], self.views.frames[reference]
        passed_s = now.timestamp_s - was.timestamp_s
        return before(was.image, passed_s, self.views.skew_s) if passed_s > 0.0 else None


def drift_since(stored: StoredCalibration, profile: Profile, seen: Sequence[Seen]) -> SceneDrift:
    """Measure what a scene tells of a stored calibration.

    Args:
        stored: the calibration.
        profile: the rig.
        seen: some multi-views of one scene.

    Raises:
        CalibrationError: the views share too few features.
    """
    geometry = geometry_from_json(stored.geometry)
    covariance = geometry.covariance
    if covariance is None:
        known = PRIOR_SIGMAS.get(str(stored.quality.get("imported")), UNKNOWN_SOURCE)
        covariance = prior_covariance(geometry, profile.prior_sigma or known)
    features = look(
        geometry,
        [one.views.images for one in seen],
        seen[0].views.frames[0].full_scale,
        [one.before(geometry.reference) for one in seen],
    )
    return scene_drift(geometry, covariance, features)


def drift_details(drift: SceneDrift, profile: Profile) -> dict[str, object]:
    """Return what is kept of a look, as plain data: angles about x, y and z."""
    return {
        "turned_deg": _by_view(drift.turned_deg, profile),
        "sigma_deg": _by_view(drift.sigma_deg, profile),
        "rows_px": drift.rows_px,
        "probability": drift.probability,
        "depth_pct": list(drift.depth_pct),
        "features": drift.features,
    }


def judge_scene_drift(
    drift: SceneDrift,
    profile: Profile,
    stored: StoredCalibration,
    temperature_degc: float | None,
    chance: float = CHANCE,
) -> Item:
    """Judge by chance first, then by how far rows have moved.

    Args:
        drift: what the scene tells.
        profile: the rig.
        stored: the calibration that it was compared with.
        temperature_degc: of the camera now, where it is known.
        chance: probability below which it is no chance.
    """
    since = f"calibration {stored.id} of {stored.created_at:%Y-%m-%d}"
    then = stored.temperature_degc
    warmth = (
        ""
        if then is None or temperature_degc is None
        else f"; {temperature_degc - then:+.1f} degC since then"
    )
    numbers = {**drift_details(drift, profile), "temperature_degc": temperature_degc}
    if drift.probability >= chance:
        found = (
            f"nothing has turned since {since} that rows tell (probability "
            f"{drift.probability:.2g}, {drift.features} features): {_sigmas(drift, profile)}; a "
            f"turn of views towards each other a scene hardly tells, a board does{warmth}"
        )
        return Item("scene", "pass", found, "", numbers)
    status: Status = graded(max(drift.rows_px, 1e-9), warn_above=0.0, fail_above=_MUCH_PX)
    return Item(
        "scene",
        status,
        f"{_turns(drift, profile)} since {since} (probability {drift.probability:.1g}); rows moved "
        f"by {drift.rows_px:.2f} px; {_depth(drift)}{warmth}",
        f"calibrate again: rig calibrate {profile.name}, or --from-scene for the rows alone",
        numbers,
    )


def _turns(drift: SceneDrift, profile: Profile) -> str:
    """Say of the view that has turned farthest, for its sigma, by how much."""
    if drift.alone == profile.reference:
        return f"{profile.views[profile.reference].name} has turned against all other views"
    told = drift.turned_deg[:, [0, 2]]
    sigma = np.where(drift.sigma_deg[:, [0, 2]] > 0.0, drift.sigma_deg[:, [0, 2]], np.inf)
    farthest = int(np.argmax(np.square(told / sigma).sum(axis=1)))
    view = farthest if drift.alone is None else drift.alone
    angle = float(np.linalg.norm(told[view]))
    along = told[view] / max(angle, 1e-12)
    error = float(np.linalg.norm(along * drift.sigma_deg[view, [0, 2]]))
    pitch, roll = told[view].tolist()
    return (
        f"{profile.views[view].name} has turned {angle:.3f} +- {error:.3f} deg (pitch {pitch:+.3f},"
        f" roll {roll:+.3f})"
    )


def _depth(drift: SceneDrift) -> str:
    low, high = drift.depth_pct
    if high - low > 2.0 * _VAGUE_PCT:
        return "what that means for depth a scene cannot tell; show the board"
    return (
        f"depth at 1 m is off by {low:+.1f}..{high:+.1f} %, if views have turned towards each "
        "other no farther than otherwise"
    )


def _sigmas(drift: SceneDrift, profile: Profile) -> str:
    said = [
        f"{view.name} pitch +-{sigma[0]:.3f}, roll +-{sigma[2]:.3f} deg"
        for view, sigma in zip(profile.views, drift.sigma_deg, strict=True)
        if sigma.any()
    ]
    return ", ".join(said)


def _by_view(angles_deg: Float, profile: Profile) -> dict[str, list[float]]:
    return {
        view.name: angles.tolist()
        for view, angles in zip(profile.views, angles_deg, strict=True)
        if view.name != profile.views[profile.reference].name
    }
