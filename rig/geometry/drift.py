"""Does one picture of the board still fit a geometric calibration? A chi-squared test."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import f as fisher

from rig.arrays import Float
from rig.errors import TargetError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

_POSE = 6
_STEPS = 8
_STEP_PX, _STEP_LENS, _STEP_RAD, _STEP_MM = 1e-3, 1e-6, 1e-7, 1e-4
"""Of the numerical derivatives: projections are smooth, so these give 8 digits."""
_SETTLED = 1e-9
"""Change of the pose, rad and mm, after which nothing is left to gain."""
_RANK = 1e-7
"""Directions that a view's picture cannot tell apart from others, relative to the clearest."""
_FEWEST_POINTS = 12
"""Of a view, so that noise is left over beside pose and lens."""


@dataclass(frozen=True, slots=True)
class Drift:
    """How a picture fits a calibration."""

    chi2_per_dof: float
    """Near 1 where nothing has moved."""
    dof: int
    """How many combinations of poses and lenses the picture can tell."""
    probability: float
    """Of a fit as bad as this or worse by chance."""
    displaced_px: dict[int, tuple[float, float]]
    """By view: mean of found minus expected position, for the board's likeliest pose."""
    rms_px: float
    """Root mean square distance of a corner from where it is expected, the noise taken off."""
    px_per_mm: float
    """Pixels of the reference camera per mm on the board: turns distances into depth."""


def measure_drift(geometry: RigGeometry, points_mm: Float, sightings: Sequence[Sighting]) -> Drift:
    """Compare one picture of the board with a calibration and its covariance.

    What no lens and no pose of any single view can explain is the noise of the corners, whatever
    the detector says of it. The rest is compared with what the calibration expects: all views share
    one pose of the board, and the geometry may give way as far as its covariance C allows
    (generalised least squares with S = sigma^2 I + J C J^T). Over the freedoms that this has less,
    the excess follows an F distribution if the rig is as it was (G. A. F. Seber and A. J. Lee,
    "Linear Regression Analysis", 2003, 3.10 and 4.3). Errors that repeat with the pixel grid are no
    drift: where edges run along rows of pixels, all points of an edge pull a corner the same way,
    by the sine of its phase, and on a board square to the grid that looks like a bent lens. Both
    sides of the comparison are free to have them, in each view by an amplitude of its own.

    Args:
        geometry: the calibration, with its covariance.
        points_mm: (P, 3) of the board.
        sightings: one picture; at most one sighting per view.

    Raises:
        TargetError: fewer than two views see enough of the board.
        ValueError: the geometry has no covariance.
    """
    if geometry.covariance is None:
        raise ValueError("a calibration without covariance cannot tell drift from chance")
    used = [sighting for sighting in sightings if len(sighting) >= _FEWEST_POINTS]
    if len(used) < 2:
        raise TargetError(
            f"drift asked for, the board is seen in {len(used)} views",
            advice="two are needed",
            reason="not-found",
        )
    picture = _Picture(geometry, points_mm, used)
    pose, residual = picture.fitted()
    by_pose, by_geometry = picture.by_pose(pose), picture.by_geometry(pose)
    by_phase = picture.by_phase(residual)
    moves = np.column_stack([by_pose, by_geometry, by_phase])
    noise = [_noise(residual[r], moves[r]) for r in picture.rows()]
    spare = sum(dof for _, dof in noise)
    noise_px2 = sum(squares for squares, _ in noise) / spare
    allowed = by_geometry @ geometry.covariance @ by_geometry.T
    weigh = cho_factor(noise_px2 * np.eye(len(residual)) + allowed)
    free = _directions(np.column_stack([by_pose, by_phase]))
    weighed = cho_solve(weigh, np.column_stack([residual, free]))
    normal, pull = free.T @ weighed[:, 1:], free.T @ weighed[:, 0]
    chi2 = float(residual @ weighed[:, 0] - pull @ np.linalg.solve(normal, pull))
    dof = len(residual) - free.shape[1] - spare
    ratio = max(0.0, chi2 - spare) / dof
    means = [residual[r].reshape(-1, 2).mean(axis=0).tolist() for r in picture.rows()]
    expected = noise_px2 * (len(residual) - _POSE)
    excess = max(0.0, float(residual @ residual) - expected)
    depth_mm = float(pose.apply(points_mm)[:, 2].mean())
    return Drift(
        ratio,
        dof,
        float(fisher.sf(ratio, dof, spare)),
        {s.view: (x, y) for s, (x, y) in zip(used, means, strict=True)},
        rms_px=float(np.sqrt(2.0 * excess / len(residual))),
        px_per_mm=geometry.cameras[geometry.reference].fx_px / depth_mm,
    )


def _directions(moves: Float) -> Float:
    """Orthonormal columns of what the columns of a matrix can tell apart."""
    moves = moves[:, np.abs(moves).max(axis=0) > 0.0]  # lenses of other views move nothing here
    left, sizes, _ = np.linalg.svd(moves / np.linalg.norm(moves, axis=0), full_matrices=False)
    return left[:, sizes > _RANK * sizes[0]]


def _noise(residual: Float, moves: Float) -> tuple[float, int]:
    """Squares of what neither pose, lens nor phase of one view explain, and how many they are."""
    free = _directions(moves)
    rest = residual - free @ (free.T @ residual)
    return float(rest @ rest), len(residual) - free.shape[1]


@dataclass(frozen=True, slots=True)
class _Picture:
    geometry: RigGeometry
    points_mm: Float
    sightings: Sequence[Sighting]

    def rows(self) -> list[slice]:
        """Rows of each view among the (2 M,) coordinates."""
        ends = np.cumsum([2 * len(s) for s in self.sightings]).tolist()
        return [slice(e - 2 * len(s), e) for s, e in zip(self.sightings, ends, strict=True)]

    def residual(self, pose: Pose, geometry: RigGeometry | None = None) -> Float:
        """(2 M,) found minus projected."""
        rig = geometry or self.geometry
        return np.concatenate(
            [
                (s.xy_px - rig.project(s.view, pose.apply(self.points_mm[s.ids]))).ravel()
                for s in self.sightings
            ]
        )

    def fitted(self) -> tuple[Pose, Float]:
        """Pose of the board in the reference frame by least squares, and what it leaves."""
        pose = self._start()
        for _ in range(_STEPS):
            solved = np.linalg.lstsq(self.by_pose(pose), self.residual(pose), rcond=None)
            change = np.asarray(solved[0], np.float64)
            pose = _moved(pose, change)
            if np.abs(change).max() < _SETTLED:
                break
        return pose, self.residual(pose)

    def by_pose(self, pose: Pose) -> Float:
        """(2 M, 6) derivative of the projections by turning and shifting the board."""
        columns: list[Float] = []
        for place in range(_POSE):
            step = _STEP_RAD if place < 3 else _STEP_MM
            change = np.zeros(_POSE)
            change[place] = step
            behind, ahead = _moved(pose, -change), _moved(pose, change)
            columns.append((self.residual(behind) - self.residual(ahead)) / (2.0 * step))
        return np.stack(columns, axis=1)

    def by_phase(self, residual: Float) -> Float:
        """(2 M, 2 V) how an error that repeats with the pixels moves corners: x, y of each view.

        By the phase where corners are expected: where all have the same, that of the found ones
        would differ by their noise alone, and take it away.
        """
        columns = np.zeros((2 * sum(map(len, self.sightings)), 2 * len(self.sightings)))
        for view, (rows, sighting) in enumerate(zip(self.rows(), self.sightings, strict=True)):
            for axis in range(2):
                expected_px = sighting.xy_px[:, axis] - residual[rows][axis::2]
                columns[rows, 2 * view + axis][axis::2] = np.sin(2.0 * np.pi * expected_px)
        return columns

    def by_geometry(self, pose: Pose) -> Float:
        """(2 M, P) derivative of the projections by the parameters that the covariance is over."""
        columns = [
            (
                self.residual(pose, _changed(self.geometry, place, -step))
                - self.residual(pose, _changed(self.geometry, place, step))
            )
            / (2.0 * step)
            for place, step in enumerate(_steps(self.geometry))
        ]
        return np.stack(columns, axis=1)

    def _start(self) -> Pose:
        first = self.sightings[0]
        ideal = self.geometry.cameras[first.view].unproject(first.xy_px)
        has_pose, turn, shift = cv2.solvePnP(
            self.points_mm[first.ids], ideal, np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE
        )
        if not has_pose:
            raise TargetError(
                "no pose of the board fits its first view",
                advice="hold the board still and nearer",
                reason="not-found",
            )
        cam_from_board = Pose.from_vectors(
            np.asarray(turn, np.float64), np.asarray(shift, np.float64)
        )
        return self.geometry.cam_from_reference[first.view].inverse() @ cam_from_board


def _moved(pose: Pose, change: Float) -> Pose:
    """Turned about the board's origin and shifted."""
    turn = Pose.from_vectors(change[:3], np.zeros(3)).rotation
    return Pose(turn @ pose.rotation, pose.translation_mm + change[3:])


def _steps(geometry: RigGeometry) -> list[float]:
    steps: list[float] = []
    for camera in geometry.cameras:
        steps += [_STEP_PX] * 4 + [_STEP_LENS] * len(camera.coefficients)
    return steps + ([_STEP_RAD] * 3 + [_STEP_MM] * 3) * (len(geometry.cameras) - 1)


def _changed(geometry: RigGeometry, place: int, step: float) -> RigGeometry:
    """The geometry with one of its parameters moved; places as in its covariance."""
    cameras, poses = list(geometry.cameras), list(geometry.cam_from_reference)
    for view, camera in enumerate(cameras):
        size = 4 + len(camera.coefficients)
        if place < size:
            cameras[view] = _lens_changed(camera, place, step)
            return replace(geometry, cameras=tuple(cameras))
        place -= size
    others = [view for view in range(len(poses)) if view != geometry.reference]
    view, number = others[place // _POSE], place % _POSE
    vector = np.concatenate([poses[view].rotation_rad, poses[view].translation_mm])
    vector[number] += step
    poses[view] = Pose.from_vectors(vector[:3], vector[3:])
    return replace(geometry, cam_from_reference=tuple(poses))


def _lens_changed(camera: CameraModel, number: int, step: float) -> CameraModel:
    values = [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.coefficients]
    values[number] += step
    fx_px, fy_px, cx_px, cy_px = values[:4]
    return replace(
        camera,
        fx_px=fx_px,
        fy_px=fy_px,
        cx_px=cx_px,
        cy_px=cy_px,
        coefficients=tuple(values[4:]),
    )
