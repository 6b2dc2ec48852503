"""Judgement of the geometric calibration: does one picture of the board still fit it?"""

from rig.arrays import Float
from rig.check.items import Item, Status, failed, graded
from rig.errors import RigError, TargetError
from rig.frames import MultiView
from rig.geometry.bundle.start_cameras import BoardPoints, board_pose
from rig.geometry.circle_bias import without_bias
from rig.geometry.drift import Drift, measure_drift
from rig.geometry.half_turn import agree_by_geometry
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_from_json
from rig.geometry.sighting import Sighting
from rig.optics.target import target_of
from rig.profile import Profile
from rig.records import StoredCalibration
from rig.run import FROM_SCENE
from rig.stored import LENSLETS
from rig.targets import CircleGrid, Target, find_target

CHANCE = 1e-3
"""Probability below which a misfit is no chance."""
SMALL_SHARE = 1.0 / 3.0
"""Share of the depth error allowed by the profile below which a misfit does not matter."""


def judge_geometry_drift(
    profile: Profile, stored: StoredCalibration | None, multiview: MultiView
) -> Item:
    """Compare one picture of the board with the stored geometric calibration of the rig.

    Args:
        profile: the rig; its views are in the order of the calibration's.
        stored: its calibration; None where it has none.
        multiview: of the board, wherever it stands.
    """
    calibrate = f"rig calibrate {profile.name}"
    if profile.target is None:
        return Item("geometry", "skip", "the profile has no [target]", "add it to the file")
    if stored is None:
        found = "nothing to compare with: this rig has no stored geometric calibration"
        return Item("geometry", "skip", found, calibrate)
    if LENSLETS in stored.geometry:
        found = f"calibration {stored.id} is one of lenslets: views of one lens cannot drift apart"
        return Item("geometry", "skip", found)
    try:
        geometry = geometry_from_json(stored.geometry)
        if geometry.covariance is None:
            found = f"calibration {stored.id} has no covariance: drift and chance look alike"
            return Item("geometry", "skip", found, calibrate)
        drift = _drift(geometry, target_of(profile.target), multiview)
    except RigError as error:  # it cannot be read, or the board is not there
        return failed("geometry", error)
    return judge_misfit(
        drift,
        profile,
        calibration=f"calibration {stored.id} of {stored.created_at:%Y-%m-%d}"
        + (" (from a scene, lengths by the pitch)" if FROM_SCENE in stored.quality else ""),
        warmer_degc=_difference(multiview.temperature_degc, stored.temperature_degc),
    )


def judge_misfit(
    drift: Drift, profile: Profile, *, calibration: str, warmer_degc: float | None
) -> Item:
    """Judge a drift by chance, and by the depth error that it stands for.

    A corner that lies off by e px in a view one step away is taken for one whose distance is wrong
    by the share e / (pitch f / Z). Long series of pictures find drifts that are certain and matter
    to nobody.

    Args:
        drift: what one picture tells.
        profile: the rig.
        calibration: which one, in words.
        warmer_degc: temperature now minus then, where both are known.
    """
    worth_pct = 100.0 * drift.rms_px / (profile.pitch_mm * drift.px_per_mm)
    allowed_pct = profile.quality.holdout_rms_pct
    status: Status = "pass"
    if drift.probability < CHANCE:
        status = graded(worth_pct, warn_above=SMALL_SHARE * allowed_pct, fail_above=allowed_pct)
    names = {view: profile.views[view].name for view in drift.displaced_px}
    moved = ", ".join(
        f"{names[view]} ({x:+.2f}, {y:+.2f})" for view, (x, y) in drift.displaced_px.items()
    )
    warmth = "" if warmer_degc is None else f"; {warmer_degc:+.1f} degC since then"
    return Item(
        "geometry",
        status,
        f"{calibration}: chi2 {drift.chi2_per_dof:.2f} per degree of freedom ({drift.dof}), "
        f"probability {drift.probability:.2g}; corners off by {drift.rms_px:.3f} px, worth "
        f"{worth_pct:.3f} % of depth, allowed {allowed_pct:.3f} %; means {moved} px{warmth}",
        ""
        if status == "pass"
        else f"a camera, a lens or the temperature has changed: rig calibrate {profile.name}",
        {
            "chi2_per_dof": drift.chi2_per_dof,
            "probability": drift.probability,
            "rms_px": drift.rms_px,
            "worth_pct": worth_pct,
            "displaced_px": {names[view]: list(xy) for view, xy in drift.displaced_px.items()},
            "warmer_degc": warmer_degc,
        },
    )


def _drift(geometry: RigGeometry, target: Target, multiview: MultiView) -> Drift:
    sightings: list[Sighting] = []
    reason: TargetError | None = None
    for view, frame in enumerate(multiview.frames):
        try:
            points = find_target(frame.image, target)
        except TargetError as error:
            reason = error
        else:
            sightings.append(Sighting(0, view, points.ids, points.xy_px, points.sigma_px))
    if len(sightings) < 2 and reason is not None:
        raise reason
    points_mm = target.points_mm.reshape(-1, 3)
    if not target.has_one_way_up:
        sightings = list(agree_by_geometry(sightings, points_mm, geometry))
    if isinstance(target, CircleGrid):
        sightings = _of_centres(sightings, geometry, points_mm, target.diameter_mm)
    return measure_drift(geometry, points_mm, sightings)


def _of_centres(
    sightings: list[Sighting], geometry: RigGeometry, points_mm: Float, diameter_mm: float
) -> list[Sighting]:
    """Sightings of ellipses as those of the centres of their circles."""
    first = sightings[0]
    seen = board_pose(
        geometry.cameras[first.view], BoardPoints(points_mm[first.ids, :2], first.xy_px)
    )
    if seen is None:
        raise TargetError(
            "circles found where the calibrated lens shows nothing",
            advice="calibrate again, or show the grid nearer to the middle of the pictures",
            reason="not-found",
        )
    pose = geometry.cam_from_reference[first.view].inverse() @ seen
    return list(without_bias(sightings, geometry, {0: pose}, points_mm, diameter_mm))


def _difference(now: float | None, then: float | None) -> float | None:
    return None if now is None or then is None else now - then
