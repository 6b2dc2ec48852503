"""A rig, a board and its pictures with known truth; projective geometry of its own.

Nothing here calls `rig.geometry`: a mistake there must not cancel itself out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rig.arrays import Float
from rig.geometry.sighting import Sighting

WIDTH, HEIGHT = 1280, 800
COLUMNS, ROWS, SQUARE_MM = 10, 7, 25.0


def turn(degrees: Sequence[float] | Float) -> Float:
    """(3, 3) rotation about an axis by its length, in degrees."""
    v = np.radians(np.asarray(degrees, np.float64))
    angle = float(np.sqrt(v @ v))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = v / angle
    c, s = np.cos(angle), np.sin(angle)
    k = 1 - c
    return np.array(
        [
            [c + x * x * k, x * y * k - z * s, x * z * k + y * s],
            [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
            [z * x * k - y * s, z * y * k + x * s, c + z * z * k],
        ]
    )


@dataclass(frozen=True)
class TrueCamera:
    """A pinhole with Brown's lens, somewhere in the reference frame."""

    centre_mm: tuple[float, float, float]
    turned_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    focal_px: tuple[float, float] = (882.0, 882.0)
    middle_px: tuple[float, float] = (639.5, 399.5)
    lens: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def numbers(self) -> Float:
        """(9,) fx, fy, cx, cy and the lens."""
        return np.array([*self.focal_px, *self.middle_px, *self.lens])

    def project(self, points_mm: Float) -> Float:
        """Pixels (N, 2) of points (N, 3) in the reference frame; NaN behind the camera."""
        inside = (points_mm - self.centre_mm) @ turn(self.turned_deg).T
        depth = np.where(inside[:, 2] > 1.0, inside[:, 2], np.nan)
        x, y = inside[:, 0] / depth, inside[:, 1] / depth
        k1, k2, p1, p2, k3 = self.lens
        rr = x**2 + y**2
        factor = 1 + rr * (k1 + rr * (k2 + rr * k3))
        u = x * factor + 2 * p1 * x * y + p2 * (rr + 2 * x**2)
        v = y * factor + p1 * (rr + 2 * y**2) + 2 * p2 * x * y
        return np.stack([u * self.focal_px[0], v * self.focal_px[1]], axis=1) + self.middle_px


@dataclass(frozen=True)
class TrueFisheye:
    """An equidistant lens with one odd term: radius = focal (angle + bend angle^3)."""

    centre_mm: tuple[float, float, float]
    turned_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    focal_px: float = 420.0
    middle_px: tuple[float, float] = (650.0, 390.0)
    bend: float = -0.03

    def project(self, points_mm: Float) -> Float:
        """Pixels (N, 2) of points (N, 3) in the reference frame; NaN behind the camera."""
        inside = (points_mm - self.centre_mm) @ turn(self.turned_deg).T
        x, y, z = inside.T
        across = np.maximum(np.hypot(x, y), 1e-12)
        angle = np.arctan2(across, np.where(z > 1.0, z, np.nan))
        radius = self.focal_px * (angle + self.bend * angle**3) / across
        return np.stack([x * radius, y * radius], axis=1) + self.middle_px


@dataclass(frozen=True)
class BoardPose:
    """Where the middle of the board is in the reference frame, and how it is turned."""

    middle_mm: tuple[float, float, float]
    turned_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """Cameras, board, poses and noise."""

    cameras: tuple[TrueCamera | TrueFisheye, ...]
    poses: tuple[BoardPose, ...]
    corner_px: float = 0.02
    """Sigma of a corner."""
    bend_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """True heights of X^2, X Y, Y^2, X and Y from -1 to 1."""
    square_mm: float = SQUARE_MM
    """True side of a square."""
    blurred: dict[int, float] = field(default_factory=dict[int, float])
    """Pictures whose corners are so many times noisier."""

    def board_mm(self) -> Float:
        """(P, 3) true points about the board's middle."""
        flat = flat_board_mm(self.square_mm)
        middle = (flat.max(axis=0) + flat.min(axis=0)) / 2
        half = (flat.max(axis=0) - flat.min(axis=0)) / 2
        x, y = ((flat - middle)[:, :2] / half[:2]).T
        a, b, c = self.bend_mm
        points = flat - middle
        points[:, 2] = a * x * x + b * x * y + c * y * y
        return points

    def shown(self, picture: int, view: int) -> Float:
        """(P, 2) where every point of the board is in one view."""
        pose = self.poses[picture]
        points = self.board_mm() @ turn(pose.turned_deg).T + pose.middle_mm
        return self.cameras[view].project(points)

    def sightings(self, seed: int) -> list[Sighting]:
        """Everything that lies in the pictures, with noise."""
        rng = np.random.default_rng(seed)
        found: list[Sighting] = []
        for picture in range(len(self.poses)):
            for view in range(len(self.cameras)):
                xy = self.shown(picture, view)
                noise = rng.standard_normal(xy.shape) * self.corner_px
                with np.errstate(invalid="ignore"):
                    inside = ((xy > 8) & (xy < (WIDTH - 9, HEIGHT - 9))).all(axis=1)
                ids = np.flatnonzero(inside)
                if len(ids) < 6:
                    continue
                xy = xy + noise * self.blurred.get(picture, 1.0)
                sigma = np.full(len(ids), 0.05)  # the solver must find the true scale itself
                found.append(Sighting(picture, view, ids, xy[ids], sigma))
        return found


def flat_board_mm(square_mm: float = SQUARE_MM) -> Float:
    """(P, 3) points as the user describes the board, x along columns, y along rows."""
    row, column = np.mgrid[0:ROWS, 0:COLUMNS].astype(np.float64)
    return np.stack([column.ravel(), row.ravel(), np.zeros(row.size)], axis=1) * square_mm


def random_cameras(rng: np.random.Generator) -> tuple[TrueCamera, ...]:
    """Three cameras, 75 mm right of and below the reference, none of them quite right."""
    cameras: list[TrueCamera] = []
    for nominal in ((0.0, 0.0, 0.0), (75.0, 0.0, 0.0), (0.0, 75.0, 0.0)):
        moved = (0.0, 0.0, 0.0) if not any(nominal) else rng.uniform(-1, 1, 3)
        turned = (0.0, 0.0, 0.0) if not any(nominal) else rng.uniform(-0.5, 0.5, 3)
        focal = 882.0 * (1 + rng.uniform(-0.01, 0.01))
        k1, k2 = rng.uniform(-0.09, -0.04), rng.uniform(0.01, 0.04)
        p1, p2 = rng.uniform(-5e-4, 5e-4, 2)
        cameras.append(
            TrueCamera(
                centre_mm=tuple(np.add(nominal, moved)),
                turned_deg=tuple(turned),
                focal_px=(focal, focal * (1 + rng.uniform(-1e-3, 1e-3))),
                middle_px=(639.5 + rng.uniform(-10, 10), 399.5 + rng.uniform(-10, 10)),
                lens=(k1, k2, p1, p2, 0.0),
            )
        )
    return tuple(cameras)


def random_poses(rng: np.random.Generator, count: int) -> tuple[BoardPose, ...]:
    """Hand-held boards at 0.35 to 1 m, tilted up to 40 degrees.

    As a guided capture asks for, they go round the nine thirds of the picture, each at random in
    its third; boards that reach over the border are seen in part.
    """
    poses: list[BoardPose] = []
    for number in range(count):
        across, down = number % 3 - 1, number // 3 % 3 - 1
        z = rng.uniform(350, 1000)
        x = (0.6 * across + rng.uniform(-0.2, 0.2)) * z * WIDTH / 2 / 882
        y = (0.6 * down + rng.uniform(-0.2, 0.2)) * z * HEIGHT / 2 / 882
        tilt = rng.uniform(-40, 40, 2)
        poses.append(BoardPose((x + 25, y + 25, z), (tilt[0], tilt[1], rng.uniform(-30, 30))))
    return tuple(poses)


def random_scene(seed: int, pictures: int = 40) -> Scene:
    """One rig and its pictures."""
    rng = np.random.default_rng(seed)
    return Scene(random_cameras(rng), random_poses(rng, pictures), bend_mm=(0.3, -0.1, 0.2))


def on_stage(scene: Scene, axis: Float, positions_mm: Float, start_mm: float) -> Scene:
    """Add pictures of the board on a stage, all turned the same way."""
    places = np.array([0.0, 0.0, start_mm]) + positions_mm[:, None] * axis
    poses = tuple(BoardPose(tuple(place), (1.0, -2.0, 0.5)) for place in places)
    return replace(scene, poses=scene.poses + poses)
