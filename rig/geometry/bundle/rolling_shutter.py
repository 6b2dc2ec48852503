"""How long a camera takes from its first row to its last, told from boards that move.

Rows that are read out one after the other see a moving board at different times. Where pictures
follow each other closely, the poses before and after one tell how fast every point of the board
moves in it; times the row, that is the shift that a second of read-out makes. What of it no pose of
the board, no lens and no bending takes up is compared with what the calibration left over. The
model of the cameras stays that of a global shutter: rolling shutters are told, and boards are to be
held still. Cf. L. Oth, P. Furgale, L. Kneip, R. Siegwart, "Rolling shutter camera calibration",
CVPR 2013, which estimates the line delay with a continuous-time motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.geometry_of import unknowns_of
from rig.geometry.bundle.linearise import Target, linearise
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.result import Calibration, Residuals
from rig.geometry.bundle.unknowns import POSE, WARP
from rig.geometry.lens import COEFFICIENTS
from rig.geometry.pose import Pose

_LONGEST_GAP_S = 0.2
"""Between pictures that tell how fast a board moves: a hand changes its mind in less than half a
second."""
_FEWEST = 5
"""Pictures of a view with a moving board before anything is told."""
_SIGMAS = 5.0
"""Above which a read-out is told from none."""


@dataclass(frozen=True, slots=True)
class Readout:
    """Time that a view takes from its first row to its last."""

    view: int
    readout_s: float
    """Positive where the upper rows come first."""
    sigma_s: float
    fastest_px_s: float
    """Speed of the fastest point of a board in the pictures that told it."""
    shift_px: float
    """Rms by which it moves points of these pictures against each other, pose taken out."""

    @property
    def is_rolling(self) -> bool:
        """Whether it differs from none by more than chance."""
        return abs(self.readout_s) > _SIGMAS * self.sigma_s


def measure_readouts(calibration: Calibration, times_s: Mapping[int, float]) -> tuple[Readout, ...]:
    """Measure the views that show boards in motion, in pictures that follow each other closely.

    Args:
        calibration: cameras, boards and what is left over.
        times_s: middle of the exposure by picture; pictures without are passed over.

    Returns:
        One per view that tells; none where boards rest or pictures are far apart.
    """
    between = _neighbours(calibration.pictures, times_s)
    poses = dict(zip(calibration.pictures, calibration.reference_from_board, strict=True))
    found: list[Readout] = []
    for view in range(len(calibration.geometry.names)):
        parts = [
            _part(calibration, one, poses, *between[one.picture])
            for one in calibration.residuals
            if one.view == view and one.picture in between and (~one.outlier).sum() > POSE
        ]
        if len(parts) >= _FEWEST:
            readout = _readout(view, parts)
            if readout is not None:
                found.append(readout)
    return tuple(found)


def readout_text(calibration: Calibration, readout: Readout) -> str:
    """Say what a rolling shutter of a view does, and whether that matters for depth."""
    geometry = calibration.geometry
    lost_pct = 1e4 * abs(readout.readout_s) / geometry.cameras[readout.view].height_px
    return (
        f"{geometry.names[readout.view]} has a rolling shutter: it reads its rows out in "
        f"{1e3 * readout.readout_s:.1f} +- {2e3 * readout.sigma_s:.1f} ms (k=2). Boards that moved "
        f"by up to {readout.fastest_px_s:.0f} px/s were bent by {readout.shift_px:.2f} px (rms): "
        "hold them still. Of what moves by 100 px/s, depth from views above each other is off by "
        f"{lost_pct:.2g} %, from views side by side it is not"
    )


def _neighbours(
    pictures: Sequence[int], times_s: Mapping[int, float]
) -> dict[int, tuple[int, int, float]]:
    """By picture: the one before, the one after, and the time between these."""
    timed = sorted((times_s[number], number) for number in pictures if number in times_s)
    found: dict[int, tuple[int, int, float]] = {}
    for (before_s, before), (now_s, now), (after_s, after) in zip(
        timed, timed[1:], timed[2:], strict=False
    ):
        if 0 < now_s - before_s < _LONGEST_GAP_S and 0 < after_s - now_s < _LONGEST_GAP_S:
            found[now] = before, after, after_s - before_s
    return found


@dataclass(frozen=True, slots=True)
class _Part:
    """What one picture says."""

    effect: Float
    """(2 N,) shift by a second of read-out, px, over the points' sigma; pose taken out."""
    left: Float
    """(2 N,) what was left over, over sigma; pose taken out."""
    by_shared: Float
    """(2 N, P) the same by the numbers of the camera and the bending of the board."""
    sigma_px: float
    speed_px_s: float


def _part(
    calibration: Calibration,
    one: Residuals,
    poses: Mapping[int, Pose],
    before: int,
    after: int,
    apart_s: float,
) -> _Part:
    geometry, kept = calibration.geometry, ~one.outlier
    points_mm = calibration.warp.bent_mm(calibration.points_mm)[one.ids[kept]]
    shown = [geometry.project(one.view, poses[p].apply(points_mm)) for p in (before, after)]
    rate_px_s = (shown[1] - shown[0]) / apart_s
    height_px = geometry.cameras[one.view].height_px
    late = (one.xy_px[kept, 1] - (height_px - 1) / 2.0) / height_px
    weight = np.repeat(1.0 / one.sigma_px[kept], 2)
    jacobian = _jacobian(calibration, one, poses[one.picture]) * weight[:, None]
    by_shared, by_pose = jacobian[:, :-POSE], jacobian[:, -POSE:]
    effect = (rate_px_s * late[:, None]).ravel() * weight
    left = one.residual_px[kept].ravel() * weight
    all_of_it = np.column_stack([effect, left, by_shared])
    all_of_it -= by_pose @ np.linalg.lstsq(by_pose, all_of_it, rcond=None)[0]
    return _Part(
        all_of_it[:, 0],
        all_of_it[:, 1],
        all_of_it[:, 2:],
        float(np.median(one.sigma_px[kept])),
        float(np.linalg.norm(rate_px_s, axis=1).max()),
    )


def _jacobian(calibration: Calibration, one: Residuals, pose: Pose) -> Float:
    """(2 N, 4 + K + 3 + 6) how the points that took part move: by camera, bending and pose."""
    kept = ~one.outlier
    count = int(kept.sum())
    observed = Observations(
        pictures=(one.picture,),
        start=np.array([0, count]),
        picture=np.zeros(1, np.int64),
        view=np.array([one.view]),
        ids=one.ids[kept].astype(np.int64),
        xy_px=one.xy_px[kept],
        sigma_px=one.sigma_px[kept],
    )
    at = unknowns_of(calibration.geometry, [pose])
    linear = linearise(observed, Target(calibration.points_mm), at)
    # Between them stands the place of the view, which is a pose of all boards together.
    numbers = 4 + COEFFICIENTS[calibration.geometry.cameras[one.view].lens]
    flat = linear.jacobian.reshape(2 * count, -1)
    return np.concatenate([flat[:, :numbers], flat[:, -POSE - WARP :]], axis=1)


def _readout(view: int, parts: Sequence[_Part]) -> Readout | None:
    shared = sum(part.by_shared.T @ part.by_shared for part in parts)
    mixed = sum(part.by_shared.T @ part.effect for part in parts)
    taken = np.linalg.lstsq(np.asarray(shared), np.asarray(mixed), rcond=None)[0]
    effects = [part.effect - part.by_shared @ taken for part in parts]
    power = np.array([float(effect @ effect) for effect in effects])
    pull = np.array([float(e @ part.left) for e, part in zip(effects, parts, strict=True)])
    total = float(power.sum())
    if not total > 0:
        return None
    readout_s = float(pull.sum()) / total
    # By how pictures disagree (clusters, as in the covariance of the solve), or by the points.
    clustered = float(np.sum((pull - readout_s * power) ** 2)) / total**2
    apart = sum(
        float(np.sum((p.left - readout_s * e) ** 2)) for e, p in zip(effects, parts, strict=True)
    )
    spare = sum(len(p.left) - POSE for p in parts) - len(taken) - 1
    single = apart / max(spare, 1) / total
    moved = sum(float(np.sum((p.effect * p.sigma_px) ** 2)) for p in parts)
    points = sum(len(p.effect) for p in parts) / 2.0
    return Readout(
        view,
        readout_s,
        float(np.sqrt(max(clustered, single))),
        max(part.speed_px_s for part in parts),
        abs(readout_s) * float(np.sqrt(moved / points)),
    )
