"""The one truth of a simulated rig: the stage moves in it, the camera looks at it.

Tests may read the truth; `rig` may not.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.devices import Clock
from rig.errors import ConfigError
from rig.profile import (
    AprilGridConfig,
    AsymmetricCirclesConfig,
    CharucoConfig,
    LensletCameraConfig,
    Profile,
    ScanCameraConfig,
    TargetConfig,
    ViewConfig,
)
from rig.profile.world import Vector, ViewErrorConfig, WorldConfig
from rig_sim.april_print import april_print, april_texel_mm
from rig_sim.board import INK, PAPER, Board, Print
from rig_sim.charuco_print import charuco_print
from rig_sim.hand import Hand, Reach
from rig_sim.optics import TrueCamera, rotation_matrix
from rig_sim.scenes.catalogue import Scene, static_shapes
from rig_sim.surface import cast
from rig_sim.track import Track

Array = NDArray[np.float64]

_POSITION_GRID_MM = 0.0005
_FOCAL_GRID_PX = 0.001
_LAMP_GRID = 1e-5


class Carriage(Protocol):
    """What carries the board."""

    def travelled_mm(self, t_s: float) -> float:
        """Return the true displacement from machine zero along the axis of travel at `t_s`."""
        ...


@dataclass(frozen=True, slots=True)
class Moment:
    """All that decides a noise-free multi-view; a plain value, so that pictures can be cached."""

    scene: Scene
    cameras: tuple[TrueCamera, ...]
    """In the profile's order."""
    board: Board | None


class World:
    """Cameras, board and surroundings of one simulated rig, as functions of time.

    The board rests on a grid of 0.5 um and the focal length on one of 0.001 px. They shift no slope
    by more than 0.0001 px and no corner of a picture by more than 0.0003 px, but they let a
    carriage that comes to rest and a slowly warming lens give the same picture again.

    Args:
        profile: a profile with a `[world]` and a camera that can look at it.
        clock: time of the whole bench; `t_s` below is its time.
        carriage: what moves the board.
        scene: what stands before the cameras: `board`, or `desk` without a board.
        in_hand: whether a hand shows the board, in place of the carriage.
        track: what carries the one camera of a scan; None where cameras stand.
        behind_diffuser: whether somebody holds a diffuser before the lens.

    Raises:
        ConfigError: the profile lacks a part that this scene needs.
    """

    def __init__(
        self,
        profile: Profile,
        *,
        clock: Clock,
        carriage: Carriage,
        scene: Scene,
        in_hand: bool = False,
        track: Track | None = None,
        behind_diffuser: bool = False,
    ) -> None:
        camera = profile.camera
        inside = camera.raw if isinstance(camera, LensletCameraConfig) else camera
        if profile.world is None or inside.size_px is None:
            raise ConfigError(
                f"profile {profile.name}: a simulated world needs a [world] section and a camera "
                f'with a size (camera.kind = "sim" or "oak"), found {camera.kind!r}',
                advice="add the section, or choose another camera",
            )
        if scene == "board" and profile.target is None:
            raise ConfigError(
                f"profile {profile.name}: scene board needs a [target] section",
                advice="add it to the file",
            )
        self.profile = profile
        self.config: WorldConfig = profile.world
        self.clock = clock
        self.scene: Scene = scene
        self.behind_diffuser = behind_diffuser
        self._sizes_px = [inside.size_of(view.name) or inside.size_px for view in profile.views]
        self._carriage = carriage
        self._began_s = clock.now_s()
        target = profile.target
        self._print = _print_of(target)
        self._track = track
        self._hand = self._new_hand() if in_hand else None

    def carried_by(self, carriage: Carriage) -> None:
        """Let another carriage than before move the board."""
        self._carriage = carriage

    def moment(self, t_s: float) -> Moment:
        """Return everything that a picture taken at `t_s` depends on."""
        focal_px = self._focal_px(t_s)
        if self._track is not None:
            cameras: tuple[TrueCamera, ...] = (
                self._moved_camera(self._track.camera_mm(t_s), focal_px),
            )
        else:
            cameras = tuple(
                self._true_camera(view, size_px, focal_px)
                for view, size_px in zip(self.profile.views, self._sizes_px, strict=True)
            )
        return Moment(self.scene, cameras, self._board(t_s))

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the cameras; a scan has one, that of the camera that is carried."""
        camera = self.profile.camera
        if isinstance(camera, ScanCameraConfig):
            return (camera.inner_view.name,)
        return tuple(view.name for view in self.profile.views)

    def lamp(self, t_s: float) -> float:
        """Return how bright the light is, 1 at the beginning."""
        lamp, passed_min = self.config.lamp, (t_s - self._began_s) / 60.0
        swing = math.sin(lamp.drift_pct_per_min * passed_min / lamp.swing_pct)
        light = 1.0 + 0.01 * lamp.swing_pct * swing
        return max(0.0, round(light / _LAMP_GRID) * _LAMP_GRID)

    def temperature_degc(self, t_s: float) -> float:
        """Return the temperature of the cameras."""
        warming = self.config.temperature
        passed_s = t_s - self._began_s
        return warming.start_degc + warming.rise_degc * -math.expm1(-passed_s / warming.time_s)

    def true_distance_mm(self, t_s: float) -> float:
        """Return the depth of the board's middle in the reference camera at `t_s`.

        Raises:
            ConfigError: this scene has no board.
        """
        moment = self.moment(t_s)
        if moment.board is None:
            raise ConfigError(
                f"scene {self.scene} has no board whose distance could be asked for",
                advice="choose scene board",
            )
        reference = self._reference_camera(moment)
        away_mm = np.asarray(moment.board.centre_mm) - np.asarray(reference.position_mm)
        return float(away_mm @ reference.rotation[:, 2])

    def true_slope_px(self, distance_mm: float, t_s: float | None = None) -> float:
        """Return the slope of a point at a depth, px per view step, for faultless view poses.

        Args:
            distance_mm: depth of the point.
            t_s: when; it matters only for a lens that drifts. Without it: when the world began.
        """
        optics = self.config.optics
        focal_px = self._focal_px(self._began_s if t_s is None else t_s)
        at_focus = 0.0 if self._track is not None else optics.focal_px / optics.focus_mm
        return self.profile.pitch_mm * (focal_px / distance_mm - at_focus)

    @property
    def focus_mm(self) -> float:
        """True focus distance: where the slope is 0."""
        return self.config.optics.focus_mm

    def true_depth_mm(self, t_s: float | None = None) -> Array:
        """Return depth along +z of the reference camera through every pixel centre, (H, W).

        Infinite where nothing is hit. Without `t_s`: now.
        """
        moment = self.moment(self.clock.now_s() if t_s is None else t_s)
        reference = self._reference_camera(moment)
        shapes = list(static_shapes(moment.scene))
        if moment.board is not None:
            shapes.append(moment.board.shape())
        directions = reference.directions(*reference.pixel_grid()) @ reference.rotation.T
        # Directions have z = 1 in the camera frame: the distance along them is the depth.
        return cast(shapes, np.asarray(reference.position_mm), directions)[0]

    def _reference_camera(self, moment: Moment) -> TrueCamera:
        if self._track is None:
            return moment.cameras[self.profile.reference]
        return self._moved_camera(self._track.reference_mm, moment.cameras[0].focal_px)

    def _moved_camera(self, position_mm: Vector, focal_px: float) -> TrueCamera:
        """The camera of a scan: one lens whose sensor is not shifted from place to place."""
        error = self.config.view_errors.get(self.views[0], ViewErrorConfig())
        x_mm, y_mm, z_mm = (
            round((place + shift) / _POSITION_GRID_MM) * _POSITION_GRID_MM
            for place, shift in zip(position_mm, error.shift_mm, strict=True)
        )
        width_px, height_px = self._sizes_px[0]
        return TrueCamera(
            view=self.views[0],
            width_px=width_px,
            height_px=height_px,
            focal_px=focal_px,
            centre_px=((width_px - 1) / 2.0, (height_px - 1) / 2.0),
            position_mm=(x_mm, y_mm, z_mm),
            rotation_deg=error.rotation_deg,
            distortion=error.distortion,
        )

    def _focal_px(self, t_s: float) -> float:
        optics = self.config.optics
        warmer_degc = self.temperature_degc(t_s) - self.config.temperature.start_degc
        focal_px = optics.focal_px * (1.0 + 1e-6 * optics.focal_drift_ppm_per_degc * warmer_degc)
        return round(focal_px / _FOCAL_GRID_PX) * _FOCAL_GRID_PX

    def _true_camera(
        self, view: ViewConfig, size_px: tuple[int, int], focal_px: float
    ) -> TrueCamera:
        """Return a view, by the focal length that the ideal camera has now."""
        optics, pitch_mm = self.config.optics, self.profile.pitch_mm
        error = self.config.view_errors.get(view.name, ViewErrorConfig())
        right_mm, down_mm = view.x_steps * pitch_mm, view.y_steps * pitch_mm
        lens = 1.0 if error.focal_px is None else error.focal_px / optics.focal_px
        # The sensor is shifted once, mechanically: it does not follow a drifting focal length.
        px_per_mm = lens * optics.focal_px / optics.focus_mm
        shift_right_mm, shift_down_mm = _in_rolled_picture(error.rotation_deg, right_mm, down_mm)
        width_px, height_px = size_px
        return TrueCamera(
            view=view.name,
            width_px=width_px,
            height_px=height_px,
            focal_px=lens * focal_px,
            centre_px=(
                (width_px - 1) / 2.0 + px_per_mm * shift_right_mm,
                (height_px - 1) / 2.0 + px_per_mm * shift_down_mm,
            ),
            position_mm=(
                right_mm + error.shift_mm[0],
                down_mm + error.shift_mm[1],
                error.shift_mm[2],
            ),
            rotation_deg=error.rotation_deg,
            distortion=error.distortion,
        )

    def _board(self, t_s: float) -> Board | None:
        target = self.profile.target
        if self.scene != "board" or target is None:
            return None
        if self._hand is not None:
            return self._printed(target, *self._hand.pose(t_s - self._began_s))
        config = self.config
        travelled_mm = self._carriage.travelled_mm(t_s)
        travelled_mm = round(travelled_mm / _POSITION_GRID_MM) * _POSITION_GRID_MM
        right, down = np.tan(np.radians(config.carriage.axis_deg))
        axis = np.array([right, down, 1.0]) / math.hypot(right, down, 1.0)
        start_mm = np.array([*config.board_offset_mm, config.carriage.board_at_machine_zero_mm])
        x_mm, y_mm, z_mm = (start_mm + travelled_mm * axis).tolist()
        return self._printed(target, (x_mm, y_mm, z_mm), (*config.board_tilt_deg, 0.0))

    def _new_hand(self) -> Hand:
        board = self._board_at_rest()
        half_width_mm, half_height_mm = board.half_size_mm.tolist()
        number = self.profile.reference
        reference = self._true_camera(
            self.profile.views[number], self._sizes_px[number], self.config.optics.focal_px
        )
        reach = Reach(
            focal_px=reference.focal_px,
            half_size_px=(reference.width_px / 2.0, reference.height_px / 2.0),
            half_board_mm=(half_width_mm, half_height_mm),
        )
        return Hand(self.config.hand, reach, seed=self.config.seed)

    def _board_at_rest(self) -> Board:
        """The board of the profile, in the middle of the world.

        Raises:
            ConfigError: the profile has none.
        """
        if self.profile.target is None:
            raise ConfigError(
                f"profile {self.profile.name}: a hand needs a [target] to show",
                advice="add it to the file",
            )
        return self._printed(self.profile.target, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def _printed(self, target: TargetConfig, centre_mm: Vector, rotation_deg: Vector) -> Board:
        """The board of the profile at a place."""
        margin_mm = self.config.board_margin_mm
        if isinstance(target, AprilGridConfig):
            if self.config.board_square_mm is not None:
                raise ConfigError(
                    "world.board_square_mm is given, an AprilGrid has no squares",
                    advice="leave it out",
                )
            return Board(
                columns=len(self._print[0]) - 1,
                rows=len(self._print) - 1,
                square_mm=april_texel_mm(target),
                margin_mm=margin_mm,
                centre_mm=centre_mm,
                rotation_deg=rotation_deg,
                print=self._print,
            )
        if isinstance(target, AsymmetricCirclesConfig):
            raise ConfigError(
                f"target.kind = {target.kind}: the simulated world does not print it",
                advice="simulate a checkerboard, a ChArUco board or an AprilGrid",
            )
        square_mm = self.config.board_square_mm or target.square_mm
        if isinstance(target, CharucoConfig):
            return Board(
                columns=target.squares_across - 1,
                rows=target.squares_down - 1,
                square_mm=square_mm,
                margin_mm=margin_mm,
                centre_mm=centre_mm,
                rotation_deg=rotation_deg,
                print=self._print,
                margin_light=INK if target.inverted else PAPER,
            )
        return Board(
            columns=target.columns,
            rows=target.rows,
            square_mm=square_mm,
            margin_mm=margin_mm,
            centre_mm=centre_mm,
            rotation_deg=rotation_deg,
        )


def _print_of(target: TargetConfig | None) -> Print:
    match target:
        case CharucoConfig():
            return charuco_print(target)
        case AprilGridConfig():
            return april_print(target)
        case _:
            return ()


def _in_rolled_picture(
    rotation_deg: Vector, right_mm: float, down_mm: float
) -> tuple[float, float]:
    """A shift in the world as a camera has it that was built in rolled by quarter turns."""
    turn = rotation_matrix(rotation_deg)
    quarters = round(math.atan2(turn[1, 0], turn[0, 0]) / (math.pi / 2.0)) % 4
    for _ in range(quarters):
        right_mm, down_mm = down_mm, -right_mm
    return right_mm, down_mm
