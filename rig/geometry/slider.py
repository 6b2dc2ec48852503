"""What a slider adds to a calibration: all views are one lens, at places along straight lines.

The bundle adjustment leaves every view free. Here its answer, with its covariance, is the
observation of a mixed linear model:

    theta = G phi + S b + error,    error ~ N(0, C),    b ~ N(0, D)

phi are the numbers of the one lens and the way of the camera per mm of each slider as its driver
reads it; b are what a real slider does beside: it leaves its line (straightness), and turns the
camera a little. The two variances of D are those of the largest restricted likelihood (H. D.
Patterson, R. Thompson, "Recovery of inter-block information when block sizes are unequal",
Biometrika 58(3), 1971), so that a straight slider is taken for straight and a bent one for bent;
phi and b then follow from the mixed model equations (C. R. Henderson, "Best linear unbiased
estimation and prediction under a selection model", Biometrics 31(2), 1975).
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rig.arrays import Float, Number
from rig.errors import CalibrationError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_STRAIGHTNESS_MM = (0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
_TURN_RAD = (0.0, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3)
_SMALL = 1e-6
_POSE = 6


@dataclass(frozen=True, slots=True)
class SliderLine:
    """The way of one slider, in the frame of the reference view (x right, y down, z forward)."""

    along: str
    """`row` or `column`."""
    direction: Float
    """(3,) unit vector of growing positions."""
    forward_deg: Number
    """Angle by which it leaves the picture plane, forward."""
    forward_sigma_deg: Number
    roll_deg: Number
    """Angle from the rows (a column: from the columns) of the picture, clockwise as seen in it."""
    roll_sigma_deg: Number
    scale: Number
    """True mm per mm of the driver."""
    scale_sigma: Number


@dataclass(frozen=True, slots=True)
class Sliders:
    """What a calibration found about the stages that carry the camera; sigmas are 1 sigma."""

    lines: tuple[SliderLine, ...]
    """Of the row, then of the column."""
    straightness_mm: Number
    """Scatter of the places about the lines, rms per direction; 0 where none was seen."""
    turn_deg: Number
    """Scatter of the orientation from place to place."""
    off_line_mm: Float
    """(V, 3) by how much each view lies off the lines; 0 for the reference."""
    place_sigma_mm: Float
    """(V, 3) 1 sigma of the place of each view against the reference."""


@dataclass(frozen=True, slots=True)
class _Model:
    """The matrices of the mixed model; V views, P numbers of the geometry."""

    fixed: Float
    """G, (P, F)."""
    off: Float
    """S of the straightness, (P, 3 V)."""
    turn: Float
    """S of the turns, (P, 3 V)."""


def tied_to_sliders(free: RigGeometry, places_mm: Float) -> tuple[RigGeometry, Sliders]:
    """Return the geometry with one lens for all views, at places along the sliders.

    Args:
        free: all views on their own, with the covariance; one lens model.
        places_mm: (V, A) position of each of the A sliders in every view, read back.

    Raises:
        CalibrationError: the geometry has no covariance, or a slider does not move.
    """
    offsets = places_mm - places_mm[free.reference]
    if free.covariance is None or not np.ptp(offsets, axis=0).all():
        raise CalibrationError(
            "asked for the direction of a slider, found views without covariance or a slider "
            "that stood still",
            advice="calibrate from pictures of all views",
        )
    theta = _numbers(free)
    unit = np.sqrt(np.diag(free.covariance))
    model = _model(free, offsets, theta)
    scaled = _Model(*((part.T / unit).T for part in (model.fixed, model.off, model.turn)))
    covariance = free.covariance / np.outer(unit, unit)
    straight_mm, turn_rad = _variances(scaled, covariance, theta / unit)
    design, prior = _mixed(scaled, straight_mm, turn_rad)
    inverse = np.linalg.inv(covariance)
    normal = design.T @ inverse @ design + np.diag(prior)
    spread: Float = np.asarray(np.linalg.inv(normal), np.float64)
    found = spread @ (design.T @ inverse @ (theta / unit))
    plain, _ = _mixed(model, straight_mm, turn_rad)
    geometry = _geometry(free, plain @ found, plain @ spread @ plain.T)
    count = model.fixed.shape[1] - 3 * offsets.shape[1]
    lines = tuple(
        _line(along, found[at : at + 3], spread[at : at + 3, at : at + 3])
        for along, at in zip(("row", "column"), range(count, model.fixed.shape[1], 3), strict=False)
    )
    return geometry, _sliders(geometry, lines, offsets, (straight_mm, turn_rad))


def _numbers(geometry: RigGeometry) -> Float:
    """(P,) numbers of a geometry in the order of its covariance."""
    lens = [
        np.array([c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.coefficients]) for c in geometry.cameras
    ]
    poses = [
        np.concatenate([pose.rotation_rad, pose.translation_mm])
        for view, pose in enumerate(geometry.cam_from_reference)
        if view != geometry.reference
    ]
    return np.concatenate([*lens, *poses])


def _model(free: RigGeometry, offsets: Float, theta: Float) -> _Model:
    views, axes = offsets.shape
    lens = 4 + len(free.cameras[0].coefficients)
    if any(4 + len(camera.coefficients) != lens for camera in free.cameras):
        raise CalibrationError(
            "views with different lens models found, one camera was carried to all of them",
            advice="give one model with --lens",
        )
    fixed = np.zeros((len(theta), lens + 3 * axes))
    off, turn = np.zeros((len(theta), 3 * views)), np.zeros((len(theta), 3 * views))
    fixed[: lens * views, :lens] = np.tile(np.eye(lens), (views, 1))
    others = [view for view in range(views) if view != free.reference]
    for number, view in enumerate(others):
        at = lens * views + _POSE * number
        shift, turned = slice(at + 3, at + 6), slice(at, at + 3)
        for axis in range(axes):
            way = slice(lens + 3 * axis, lens + 3 * axis + 3)
            fixed[shift, way] = -offsets[view, axis] * np.eye(3)
        own = slice(3 * view, 3 * view + 3)
        home = slice(3 * free.reference, 3 * free.reference + 3)
        off[shift, own], off[shift, home] = -np.eye(3), np.eye(3)
        # A camera that turns by r at the place c has the shift -(1 + [r]) c: by r, that is [c] r.
        turn[turned, own] = np.eye(3)
        turn[shift, own] = _cross(free.cam_from_reference[view].centre_mm)
    return _Model(fixed, off, turn)


def _variances(model: _Model, covariance: Float, theta: Float) -> tuple[float, float]:
    """Straightness (mm) and turn (rad) of the largest restricted likelihood."""
    likely = {
        pair: _likelihood(model, covariance, theta, *pair)
        for pair in product(_STRAIGHTNESS_MM, _TURN_RAD)
    }
    return max(likely, key=lambda pair: likely[pair])


def _likelihood(
    model: _Model, covariance: Float, theta: Float, straight_mm: float, turn_rad: float
) -> float:
    spread = covariance + straight_mm**2 * model.off @ model.off.T
    spread = spread + turn_rad**2 * model.turn @ model.turn.T
    inverse = np.linalg.inv(spread)
    normal = model.fixed.T @ inverse @ model.fixed
    found = np.linalg.solve(normal, model.fixed.T @ inverse @ theta)
    left = theta - model.fixed @ found
    logs = float(np.linalg.slogdet(spread)[1]) + float(np.linalg.slogdet(normal)[1])
    return -0.5 * (logs + float(left @ inverse @ left))


def _mixed(model: _Model, straight_mm: float, turn_rad: float) -> tuple[Float, Float]:
    """Design (P, F + B) of the mixed model, and the prior information about each column."""
    parts, prior = [model.fixed], [np.zeros(model.fixed.shape[1])]
    for part, sigma in ((model.off, straight_mm), (model.turn, turn_rad)):
        if sigma > 0.0:
            parts.append(part)
            prior.append(np.full(part.shape[1], sigma**-2.0))
    return np.concatenate(parts, axis=1), np.concatenate(prior)


def _geometry(free: RigGeometry, theta: Float, covariance: Float) -> RigGeometry:
    lens = 4 + len(free.cameras[0].coefficients)
    views = len(free.names)
    cameras = tuple(
        _camera(free.cameras[view], theta[lens * view : lens * (view + 1)]) for view in range(views)
    )
    poses = list(free.cam_from_reference)
    others = [view for view in range(views) if view != free.reference]
    for number, view in enumerate(others):
        at = lens * views + _POSE * number
        poses[view] = Pose.from_vectors(theta[at : at + 3], theta[at + 3 : at + 6])
    return replace(
        free,
        cameras=cameras,
        cam_from_reference=tuple(poses),
        covariance=(covariance + covariance.T) / 2.0,
    )


def _camera(like: CameraModel, numbers: Float) -> CameraModel:
    fx_px, fy_px, cx_px, cy_px, *coefficients = numbers.tolist()
    return replace(
        like,
        fx_px=fx_px,
        fy_px=fy_px,
        cx_px=cx_px,
        cy_px=cy_px,
        coefficients=tuple(coefficients),
    )


def _line(along: str, way: Float, covariance: Float) -> SliderLine:
    values = _angles(along, way)
    by_way = np.stack(
        [
            (_angles(along, way + step) - _angles(along, way - step)) / (2.0 * _SMALL)
            for step in _SMALL * np.eye(3)
        ],
        axis=1,
    )
    sigma = np.sqrt(np.diag(by_way @ covariance @ by_way.T))
    return SliderLine(
        along=along,
        direction=way / np.linalg.norm(way),
        forward_deg=float(values[0]),
        forward_sigma_deg=float(sigma[0]),
        roll_deg=float(values[1]),
        roll_sigma_deg=float(sigma[1]),
        scale=float(values[2]),
        scale_sigma=float(sigma[2]),
    )


def _angles(along: str, way: Float) -> Float:
    """Forward (deg), roll (deg), scale of a way per mm."""
    length = float(np.linalg.norm(way))
    right, down, ahead = (way / length).tolist()
    forward = np.degrees(np.arcsin(ahead))
    turn = np.arctan2(down, right) if along == "row" else np.arctan2(-right, down)
    return np.array([forward, np.degrees(turn), length])


def _sliders(
    geometry: RigGeometry,
    lines: tuple[SliderLine, ...],
    offsets: Float,
    scatter: tuple[float, float],
) -> Sliders:
    ways = np.stack([line.scale * line.direction for line in lines])
    covariance = geometry.covariance
    if covariance is None:
        raise AssertionError  # it has just been given one
    sigma = np.zeros((len(geometry.names), 3))
    first = geometry.parameter_count - _POSE * (len(geometry.names) - 1)
    others = [view for view in range(len(geometry.names)) if view != geometry.reference]
    for number, view in enumerate(others):
        pose = geometry.cam_from_reference[view]
        own = slice(first + _POSE * number, first + _POSE * (number + 1))
        # The place is -R' t; for the small turns of a slider that moves with both.
        by_pose = -np.concatenate([_cross(pose.translation_mm), np.eye(3)], axis=1)
        sigma[view] = np.sqrt(np.diag(by_pose @ covariance[own, own] @ by_pose.T))
    straight_mm, turn_rad = scatter
    return Sliders(
        lines=lines,
        straightness_mm=straight_mm,
        turn_deg=float(np.degrees(turn_rad)),
        off_line_mm=geometry.centres_mm() - offsets @ ways,
        place_sigma_mm=sigma,
    )


def _cross(vector: Float) -> Float:
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
