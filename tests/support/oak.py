"""OAK cameras without a device: the whole pipeline, fed by simulated sensors or by plain frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rig_drivers.oak.board import board_socket
from rig_drivers.oak.camera import OakCamera
from rig_drivers.oak.host_sensors import HostSensors
from rig_drivers.oak.sdk import dai
from rig_sim.oak import SensorFaults, SimOakRack
from rig_sim.world import World

from rig.devices import SystemClock
from rig.profile import OakCameraConfig, Profile
from rig.profile.load import load_profile
from tests.support.cameras import Slide

SMALL = ("camera.width_px=160", "camera.height_px=100", "world.optics.focal_px=152.5")


@dataclass
class OakRig:
    """The `sim-oak` profile with coarse sensors."""

    overrides: Sequence[str] = ()
    faults: Mapping[str, SensorFaults] | None = None

    def __post_init__(self) -> None:
        self.profile: Profile = load_profile(
            "sim-oak", ("world.renderer=analytic", *SMALL, "camera.rate_hz=50", *self.overrides)
        )
        self.clock = SystemClock()
        self.slide = Slide()
        self.world = World(self.profile, clock=self.clock, carriage=self.slide, scene="board")

    @property
    def config(self) -> OakCameraConfig:
        assert isinstance(self.profile.camera, OakCameraConfig)
        return self.profile.camera

    def sensors(self) -> HostSensors:
        return HostSensors(SimOakRack(self.config, self.world, self.faults))

    def camera(self) -> OakCamera:
        names = [view.name for view in self.profile.views]
        return OakCamera(self.config, names, self.sensors(), self.clock)


def with_view(name: str) -> tuple[str, ...]:
    """Overrides that give `sim-oak` a fifth view, below the reference."""
    names = ("centre", "left", "right", "top", name)
    places = ((0.0, 0.0), (-1.06, 0.0), (0.93, 0.0), (0.0, -0.95), (0.0, 1.08))
    views = ", ".join(
        f'{{name = "{view}", x_steps = {x}, y_steps = {y}}}'
        for view, (x, y) in zip(names, places, strict=True)
    )
    return f"views=[{views}]", f'camera.sockets.{name}="CAM_E"'


def oak_config(**changes: Any) -> OakCameraConfig:
    """A pair of sensors as on an OAK-D, with some keys changed."""
    plain: dict[str, Any] = {
        "kind": "oak",
        "sockets": {"left": "CAM_B", "right": "CAM_C"},
        "width_px": 1280,
        "height_px": 800,
        "rate_hz": 10.0,
        "exposure_s": 0.008,
    }
    return OakCameraConfig(**{**plain, **changes})


MODES = ((1280, 800, 129.6), (640, 400, 255.7))
"""Sizes of an OV9282, and the rates that it reaches."""
IMX378 = ((4056, 3040, 30.0), (3840, 2160, 42.0), (1920, 1080, 60.0))
"""Those of the colour sensor of an OAK-D."""


def feature(
    socket: str,
    *,
    focus: bool = False,
    colour: bool = False,
    name: str = "OV9282",
    sizes: Sequence[tuple[int, int, float]] = MODES,
) -> dai.CameraFeatures:
    """An OV9282, or something like it, as the device describes it."""
    found = dai.CameraFeatures()
    found.socket = board_socket(socket)
    found.sensorName = name
    found.width, found.height, _ = sizes[0]
    found.hasAutofocus = focus
    kind = dai.CameraSensorType.COLOR if colour else dai.CameraSensorType.MONO
    found.supportedTypes = [kind]
    modes: list[dai.CameraSensorConfig] = []
    for width, height, fastest_hz in sizes:
        mode = dai.CameraSensorConfig()
        mode.width, mode.height, mode.maxFps, mode.type = width, height, fastest_hz, kind
        modes.append(mode)
    found.configs = modes
    return found


def three_views(**changes: Any) -> OakCameraConfig:
    """An OAK-D with its colour camera between the pair."""
    colour = {
        "width_px": 1920,
        "height_px": 1080,
        "pixels": "nv12",
        "exposure_s": 0.004,
        "iso": 200,
        "lens_position": 130,
        "white_balance_k": 5000,
    }
    plain: dict[str, Any] = {
        "sockets": {"left": "CAM_B", "middle": "CAM_A", "right": "CAM_C"},
        "sensors": {"middle": colour},
    }
    return oak_config(**{**plain, **changes})


def three_features() -> list[dai.CameraFeatures]:
    """What the board of an OAK-D finds."""
    middle = feature("CAM_A", focus=True, colour=True, name="IMX378", sizes=IMX378)
    return [middle, feature("CAM_B"), feature("CAM_C")]


def oak_d(focal_px: float = 800.0) -> dai.CalibrationHandler:
    """The EEPROM of an OAK-D: a pair 75 mm apart, kept as 7.5 cm."""
    handler = dai.CalibrationHandler()
    handler.setBoardInfo("OAK-D", "R1M0E1")
    left, right = board_socket("CAM_B"), board_socket("CAM_C")
    for socket in (left, right):
        matrix = [[focal_px, 0.0, 640.5], [0.0, focal_px, 400.5], [0.0, 0.0, 1.0]]
        handler.setCameraIntrinsics(socket, matrix, dai.Size2f(1280.0, 800.0))
        handler.setDistortionCoefficients(socket, [0.01 * k for k in range(14)])
    straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    handler.setCameraExtrinsics(right, left, straight, [7.5, 0.0, 0.0], [7.5, 0.0, 0.0])
    return handler
