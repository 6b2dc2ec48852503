"""Rectification: one common frame and focal length for all views, and their fractional places.

In the common frame every view is a pinhole camera of one orientation. It is chosen so that the
optical centres lie in its x-y plane as well as they can (least squares): what is left in front of
or behind that plane is then orthogonal to the places of the views, and moves no slope to first
order. The reference camera's own orientation would leave the whole tilt of the array in the views.

With `m` the slope, `m0` the slope between infinity and the focus distance, `(x, y, z)` the place of
a view in view steps (z in steps of one focal length, see `Rectification.z_steps`) and `p` a pixel
of the reference view, counted from its principal point, the same point appears in that view at

    (1 - m0 z) (p - (m + m0) (x, y)) / (1 - (m + m0) z) + m0 (x, y)

exactly; for z = 0 this is the straight line p - m (x, y).
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pinhole import Pinhole
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_FLAT = 0.1
"""Spread of the optical centres across their longest direction, as a share of that, below which
they are one line: the plane through them can turn about it, and is left as the reference has it."""
_NEAR_AXIS_RAD = 0.1
"""A view within this angle of the horizontal or the vertical belongs to the row or the column."""


@dataclass(frozen=True, slots=True)
class Rectification:
    """The common frame of a rig, and the exact way from its pixels to those of the raw pictures."""

    geometry: RigGeometry
    camera: CameraModel
    """The reference view in the common frame: no lens, square pixels."""
    common_from_reference: Float
    """(3, 3) rotation from the reference camera's frame into the common one."""
    x_steps: Float
    """(V,) places of the views along the common frame's x axis, in view steps."""
    y_steps: Float
    """(V,)."""
    z_steps: Float
    """(V,) forward offset divided by (focal length in px times view step in mm), per px."""
    infinity_px: float
    """`m0`: what a point at infinity has as slope is -m0; 0 for parallel pictures."""
    pitch_mm: float
    """Length of one view step."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of every rectified view, px."""
        return self.camera.height_px, self.camera.width_px

    @property
    def centre_px(self) -> Float:
        """(2,) principal point of the rectified reference view."""
        return np.array([self.camera.cx_px, self.camera.cy_px])

    @property
    def focus_mm(self) -> float:
        """Depth on the reference camera's optical axis at which the slope is 0; infinite for none.

        Negative for pictures that never agree before infinity.
        """
        if self.infinity_px == 0.0:
            return float("inf")
        return self.inverse_law_px_mm / self.infinity_px

    @property
    def inverse_law_px_mm(self) -> float:
        """`a` of the axis slope m = a / Z - m0 that this geometry predicts."""
        return self.camera.fx_px * self.pitch_mm / float(self.common_from_reference[2, 2])

    def line_px(self, view: int, reference_px: Float, slope_px: Float) -> Float:
        """Where points of the reference view appear in another rectified view.

        Args:
            view: index.
            reference_px: (2, N) pixels of the rectified reference view.
            slope_px: (N,) slopes, px per view step.

        Returns:
            (2, N) pixels of that rectified view.
        """
        step = np.array([self.x_steps[view], self.y_steps[view]])[:, None]
        z = float(self.z_steps[view])
        m0 = self.infinity_px
        centre = self.centre_px[:, None]
        whole = slope_px + m0
        away = (reference_px - centre - whole * step) * ((1.0 - m0 * z) / (1.0 - whole * z))
        return centre + m0 * step + away

    def raw_px(self, view: int, rectified_px: Float) -> Float:
        """Pixels (N, 2) of a raw picture that rectified pixels (N, 2) come from.

        NaN where the camera does not look in that direction.
        """
        rays = np.ones((len(rectified_px), 3))
        rays[:, :2] = (np.asarray(rectified_px) - self._principal_px(view)) / self._focal_px(view)
        return self.geometry.cameras[view].project(rays @ self.camera_from_common(view).T)

    def rectified_px(self, view: int, raw_px: Float) -> Float:
        """Rectified pixels (N, 2) of pixels (N, 2) of a raw picture; NaN where there are none."""
        rays = np.ones((len(raw_px), 3))
        rays[:, :2] = self.geometry.cameras[view].unproject(np.asarray(raw_px, np.float64))
        rays = rays @ self.camera_from_common(view)
        ahead = rays[:, 2] > 0
        xy = rays[:, :2] / np.where(ahead, rays[:, 2], np.nan)[:, None]
        return xy * self._focal_px(view) + self._principal_px(view)

    def raw_map_px(self, view: int) -> Float:
        """(H, W, 2) raw pixel of every rectified pixel."""
        height, width = self.shape
        x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        flat = self.raw_px(view, np.stack([x.ravel(), y.ravel()], axis=1))
        return flat.reshape(height, width, 2)

    def finer(self, view: int) -> float:
        """Raw pixels of a view per rectified pixel, along a line in the middle of its picture."""
        square = _middle_px(self.geometry.cameras[view]) + np.array(
            [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
        )
        here, right, below = self.rectified_px(view, square)
        return float(abs(np.linalg.det([right - here, below - here])) ** -0.5)

    def depth_ratio(self, reference_px: Float) -> Float:
        """Depth along the reference camera's +z over depth along the common frame's z.

        1 on the optical axis of the reference camera by definition of `axis_slope_px`; linear in
        the pixel.

        Args:
            reference_px: (2, ...) pixels of the rectified reference view.
        """
        forward = self.common_from_reference[:, 2]
        focal_px = self.camera.fx_px
        x = (np.asarray(reference_px[0]) - self.camera.cx_px) / focal_px
        y = (np.asarray(reference_px[1]) - self.camera.cy_px) / focal_px
        return forward[2] * (forward[0] * x + forward[1] * y + forward[2])

    def axis_slope_px(self, slope_px: Float, reference_px: Float) -> Float:
        """Slope that a point of the same depth has on the reference camera's optical axis.

        Depth is counted along the reference camera's +z, slopes along the common frame's z; the
        two differ by a factor that is linear in the pixel. A depth-slope curve is a function of
        this slope, so that one curve serves the whole picture.

        Args:
            slope_px: (...) slopes of the rectified views.
            reference_px: (2, ...) pixels of the rectified reference view.
        """
        m0 = self.infinity_px
        return (slope_px + m0) / self.depth_ratio(reference_px) - m0

    @property
    def pinhole(self) -> Pinhole:
        """The rectified reference view as the camera of depth maps."""
        camera = self.camera
        return Pinhole(
            camera.width_px,
            camera.height_px,
            camera.fx_px,
            (camera.cx_px, camera.cy_px),
            self.common_from_reference,
        )

    def _focal_px(self, view: int) -> float:
        """Scaled so that a view before the plane agrees with the others at the focus distance."""
        return self.camera.fx_px * (1.0 - self.infinity_px * float(self.z_steps[view]))

    def _principal_px(self, view: int) -> Float:
        step = np.array([self.x_steps[view], self.y_steps[view]])
        return self.centre_px + self.infinity_px * step

    def camera_from_common(self, view: int) -> Float:
        """(3, 3) rotation from the common frame into that of a raw camera."""
        rotation = self.geometry.cam_from_reference[view].rotation
        return rotation @ self.common_from_reference.T

    def view_camera(self, view: int) -> CameraModel:
        """Return the pinhole camera that a rectified view is."""
        focal_px = self._focal_px(view)
        cx_px, cy_px = self._principal_px(view).tolist()
        return replace(self.camera, fx_px=focal_px, fy_px=focal_px, cx_px=cx_px, cy_px=cy_px)

    @property
    def places_mm(self) -> Float:
        """(V, 3) optical centres in the common frame, from that of the reference camera."""
        forward = self.z_steps * self.camera.fx_px
        return np.stack([self.x_steps, self.y_steps, forward], axis=1) * self.pitch_mm

    def projection_m(self, view: int) -> Float:
        """(3, 4) projection of points (m) of the common frame into a rectified view.

        Its last column has no room for what a view stands before or behind the others.
        """
        pinhole = self.view_camera(view)
        projection = np.zeros((3, 4))
        projection[:, :3] = pinhole.matrix
        projection[:2, 3] = 0.0 - pinhole.fx_px * self.places_mm[view, :2] / 1000.0
        return projection


def rectify(geometry: RigGeometry, pitch_mm: float) -> Rectification:
    """Choose the common frame of a rig.

    The focal length is that of the reference view and the picture as large as its own, whatever
    the other views are. Principal points differ from view to view in proportion to the views'
    places, so that lines stay straight, and as nearly as that allows such that every picture keeps
    its middle.

    Args:
        geometry: the calibrated rig.
        pitch_mm: length of one view step.

    Raises:
        ConfigError: all views stand at one place.
    """
    centres_mm = geometry.centres_mm()
    common_from_reference = _upright(_facing(_normal(centres_mm)), centres_mm)
    places_mm = centres_mm @ common_from_reference.T
    if float(np.hypot(places_mm[:, 0], places_mm[:, 1]).max()) < 1e-6 * pitch_mm:
        raise ConfigError(
            "all cameras of the calibration stand at one place", advice="slopes need a baseline"
        )
    reference = geometry.cameras[geometry.reference]
    focal_px = (reference.fx_px + reference.fy_px) / 2.0
    middle_px, per_mm = _principal_points(geometry, common_from_reference, places_mm, focal_px)
    steps = places_mm / pitch_mm
    return Rectification(
        geometry=geometry,
        camera=CameraModel(
            reference.width_px,
            reference.height_px,
            focal_px,
            focal_px,
            float(middle_px[0]),
            float(middle_px[1]),
        ),
        common_from_reference=common_from_reference,
        x_steps=steps[:, 0],
        y_steps=steps[:, 1],
        z_steps=steps[:, 2] / focal_px,
        infinity_px=per_mm * pitch_mm,
        pitch_mm=pitch_mm,
    )


def _normal(centres_mm: Float) -> Float:
    """(3,) unit normal, forwards, of the plane through the optical centres."""
    away = centres_mm - centres_mm.mean(axis=0)
    # The least tilt of those that fit: a row of cameras says nothing about a turn about itself.
    tilt, *_ = np.linalg.lstsq(away[:, :2], away[:, 2], rcond=_FLAT)
    normal = np.array([-tilt[0], -tilt[1], 1.0])
    return normal / np.linalg.norm(normal)


def _facing(normal: Float) -> Float:
    """(3, 3) the shortest rotation that turns a direction into +z."""
    axis = np.cross(normal, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return np.eye(3)
    angle_rad = float(np.arctan2(sine, normal[2]))
    return Pose.from_vectors(axis / sine * angle_rad, np.zeros(3)).rotation


def _upright(facing: Float, centres_mm: Float) -> Float:
    """(3, 3) the frame turned about its own z, so that rows and columns of views lie along x and y.

    Matchers need that, and estimators are quicker for it. Views far from both axes have no say.
    """
    x, y = (centres_mm @ facing.T)[:, :2].T
    across = np.arctan2(y * np.sign(x), np.abs(x))
    down = -np.arctan2(x * np.sign(y), np.abs(y))
    turn_rad = np.where(np.abs(x) >= np.abs(y), across, down)
    weight = np.where(np.abs(turn_rad) < _NEAR_AXIS_RAD, x * x + y * y, 0.0)
    if not weight.sum() > 0.0:
        return facing
    back_rad = -float(weight @ turn_rad / weight.sum())
    return Pose.from_vectors(np.array([0.0, 0.0, back_rad]), np.zeros(3)).rotation @ facing


def _principal_points(
    geometry: RigGeometry, common_from_reference: Float, places_mm: Float, focal_px: float
) -> tuple[Float, float]:
    """Principal point of the reference view, and by how much it moves per mm of a view's place."""
    rows: list[Float] = []
    wanted: list[Float] = []
    common_px = _middle_px(geometry.cameras[geometry.reference])
    for view, camera in enumerate(geometry.cameras):
        ray = np.array([*camera.unproject(_middle_px(camera)[None])[0], 1.0])
        direction = common_from_reference @ geometry.cam_from_reference[view].rotation.T @ ray
        wanted.append(common_px - focal_px * direction[:2] / direction[2])
        rows.append(np.column_stack([np.eye(2), places_mm[view, :2]]))
    solved, *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=None)
    fitted = np.asarray(solved, np.float64)
    return fitted[:2], float(fitted[2])


def _middle_px(camera: CameraModel) -> Float:
    """(2,) middle of a camera's picture."""
    return np.array([(camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0])
