"""The truth of a simulated rig: what `sim` builds and `rig` never looks at."""

from typing import Literal, Self

from pydantic import Field, model_validator

from rig.profile.lenslet_world import LensletWorldConfig
from rig.profile.model import Model, NotNegative, Positive

Vector = tuple[float, float, float]


class OpticsConfig(Model):
    """The ideal cameras: one focal length, sheared so that the focus distance has no disparity."""

    focal_px: Positive
    """True focal length of every camera, px."""
    focus_mm: Positive
    """Distance at which all views agree (slope 0), mm."""
    blur_px: NotNegative = 0.8
    """Standard deviation of the Gaussian point spread, px."""
    focal_drift_ppm_per_degc: float = 0.0
    """Relative change of the focal length with temperature, parts per million per degree C."""


class SensorConfig(Model):
    """From light to grey levels."""

    bits: Literal[8, 16] = 8
    """Bits per pixel of the delivered image."""
    electrons_per_level: Positive = 40.0
    """Photo-electrons per 8-bit grey level: sets the shot noise."""
    read_noise_levels: NotNegative = 1.0
    """Standard deviation of the read noise, 8-bit grey levels."""
    black_level: NotNegative = 4.0
    """Grey level without any light."""


class ViewErrorConfig(Model):
    """How one true camera differs from the ideal one."""

    focal_px: Positive | None = None
    """True focal length of a view with another lens or other pixels, px."""
    gain: Positive = 1.0
    """Brightness relative to the ideal camera."""
    offset_levels: float = 0.0
    """Added to every pixel, 8-bit grey levels."""
    shift_mm: Vector = (0.0, 0.0, 0.0)
    """Optical centre away from its nominal place: right, down, forward."""
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation about the camera's x, y and z axis (Rodrigues vector); [0, 0, 180] stands upside
    down."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Brown-Conrady k1, k2, p1, p2, k3."""


class MechanicsConfig(Model):
    """The mechanics of a simulated stage, between motor and what it carries."""

    scale: Positive = 1.0
    """True mm per mm that the controller believes."""
    power_up_mm: float = -350.0
    """Machine coordinate at which the carriage stands when power comes."""
    backlash_mm: NotNegative = 0.0
    """Play between motor and carriage when the direction changes."""
    ring_mm: NotNegative = 0.0
    """Amplitude of the carriage's oscillation at the end of a move."""
    ring_hz: Positive = 12.0
    """Its frequency."""
    ring_decay_s: Positive = 0.06
    """Time in which it falls to 1/e."""
    slip_mm: NotNegative = 0.7
    """How far the motor loses its place when it is stopped dead in motion."""
    has_switch: bool = True
    """Whether the reference switch works; homing fails without it."""


class CarriageConfig(MechanicsConfig):
    """The stage that carries the board."""

    axis_deg: tuple[float, float] = (0.0, 0.0)
    """Direction of travel against the optical axis: towards the right, downwards."""
    board_at_machine_zero_mm: Positive
    """True distance of the board from the reference camera at machine coordinate 0."""


class LampConfig(Model):
    """The light of the scene."""

    drift_pct_per_min: float = 0.0
    """Fastest change of its brightness, per cent of that at the beginning per minute."""
    swing_pct: Positive = 5.0
    """How far it goes to either side before it turns."""


class ZaberFirmwareConfig(Model):
    """What a simulated Zaber chain has beyond `FirmwareConfig`."""

    addresses: tuple[int, ...] = (1,)
    """Numbers of the devices in the chain."""
    address: int = 1
    """The device that carries the board,"""
    axis: int = Field(default=1, ge=1)
    """and which of its axes does."""
    axes: int = Field(default=1, ge=1, le=9)
    """How many axes every device has."""
    version: str = "7.33"
    """Firmware version."""
    serial_number: int = 91000
    """Serial number of a device less its address."""
    checksum: bool = True
    """Whether answers end with a checksum."""
    lacks: tuple[str, ...] = ()
    """Settings that its firmware does not know; `driver` for the command that switches motors."""
    is_binary: bool = False
    """Whether it is set to the binary protocol, which rig does not speak."""

    @model_validator(mode="after")
    def _the_board_is_carried(self) -> Self:
        if self.address not in self.addresses or self.axis > self.axes:
            raise ValueError(
                f"axis {self.axis} of device {self.address} carries the board, there are devices "
                f"{', '.join(map(str, self.addresses))} with {self.axes} axes each"
            )
        return self


class MarlinFirmwareConfig(Model):
    """What a simulated Marlin has beyond `FirmwareConfig`."""

    emergency_parser: bool = True
    """Whether M112 and M410 are heeded at once, even while another command is at work."""
    advanced_ok: bool = False
    """Whether `ok` tells the number of its line."""
    busy_s: Positive = 2.0
    """Time between two `echo:busy` while a command is at work."""
    axes: int = Field(default=3, ge=1, le=9)
    """How many axes it is built with."""
    answers_late: bool = False
    """Whether it answers questions after its `ok`, as some old ones do."""


class FirmwareConfig(Model):
    """Settings of the simulated controller."""

    axis: Literal["X", "Y", "Z"] = "X"
    """The axis that carries the board; the others turn no motor."""
    boot_s: NotNegative = 1.6
    """Time from opening the port, which resets the board, to the banner."""
    max_rate_mm_s: Positive = 100.0
    """Fastest motion."""
    acceleration_mm_s2: Positive = 400.0
    """Acceleration and deceleration."""
    travel_mm: Positive = 820.0
    """Soft-limit travel; machine coordinates run from -travel to 0."""
    pull_off_mm: Positive = 2.0
    """Distance from the switch at which homing ends."""
    homing: bool = True
    """Whether the controller homes, and is locked until it has."""
    homing_mm_s: Positive = 100.0
    """Speed of the search for the switch."""
    homing_locate_mm_s: Positive = 5.0
    """Speed of the second, slow approach to it."""
    homing_pause_s: NotNegative = 0.25
    """Pause after each part of homing."""
    soft_limits: bool = True
    """Whether moves beyond the travel are refused."""
    hard_limits: bool = False
    """Whether the closing switch stops everything."""
    steps_per_mm: Positive = 400.0
    """Resolution of the motor."""
    grbl_dialect: Literal["grbl", "grblhal", "fluidnc"] = "grbl"
    """Which descendant of GRBL a GRBL controller is."""
    homes_z_first: bool = False
    """Whether `$H` of a GRBL controller homes every axis, Z first, as stock firmware does: only
    the carriage has a switch, so that fails."""
    homes_single_axis: bool = True
    """Whether a grblHAL controller homes one axis alone (`$HX`); fresh from its makers it does
    not."""
    connecting_s: NotNegative = 0.0
    """How long a GRBL controller with WiFi looks for its network before it answers."""
    zaber: ZaberFirmwareConfig = ZaberFirmwareConfig()
    """More, where the controller is a Zaber chain."""
    marlin: MarlinFirmwareConfig = MarlinFirmwareConfig()
    """More, where it is a Marlin."""


class SliderConfig(MechanicsConfig):
    """A stage that carries the camera; the camera itself looks straight ahead."""

    power_up_mm: float = -80.0
    """Machine coordinate at which the carriage stands when power comes."""
    camera_at_machine_zero_mm: float
    """Way of the camera from the origin of the world at machine coordinate 0."""
    forward_deg: float = 0.0
    """Angle by which the travel leaves the picture plane, forward."""
    roll_deg: float = 0.0
    """Angle by which it leaves the rows (a column: the columns) of the picture, clockwise."""
    bow_mm: float = 0.0
    """How far the track sags, downwards (a column: to the right), at `bow_length_mm` from the
    origin."""
    bow_length_mm: Positive = 100.0
    """See `bow_mm`."""
    firmware: FirmwareConfig = FirmwareConfig(travel_mm=200.0)
    """Its controller."""


class HandConfig(Model):
    """A hand that holds the board before the cameras, as in a geometric calibration."""

    hold_s: Positive = 0.9
    """How long it holds the board still."""
    move_s: Positive = 0.3
    """How long it takes to the next pose."""
    nearest_mm: Positive = 380.0
    """Nearest distance of the board."""
    farthest_mm: Positive = 900.0
    """Farthest."""
    tilt_deg: NotNegative = 38.0
    """Largest tilt."""
    roll_deg: NotNegative = 15.0
    """Largest turn in the plane of the picture."""


class TemperatureConfig(Model):
    """Slow warming of the rig: T(t) = start + rise * (1 - exp(-t / time))."""

    start_degc: float = 25.0
    """Temperature when the world begins."""
    rise_degc: float = 0.0
    """How much it rises in the end."""
    time_s: Positive = 600.0
    """Time constant."""


class WorldConfig(Model):
    """Everything true about a simulated rig."""

    clock: Literal["fast", "real"] = "fast"
    """`fast`: simulated time passes as quickly as the computer can; `real`: it takes its time."""
    renderer: Literal["mitsuba", "analytic"] = "mitsuba"
    """`mitsuba` traces rays in a scene; `analytic` draws the board only, in closed form."""
    samples_per_px: int = Field(default=16, ge=1, le=65536)
    """Rays per pixel."""
    sweep_scene: Literal["board", "desk"] = "board"
    """What the camera sees while a stage carries the board."""
    capture_scene: Literal["board", "desk"] = "desk"
    """What it sees when no stage is in use."""
    seed: int = Field(default=1, ge=0)
    """Seed of all noise; the same seed gives the same frames."""
    optics: OpticsConfig
    """Lens and arrangement of the ideal cameras."""
    sensor: SensorConfig = SensorConfig()
    """Noise and grey levels."""
    lenslets: LensletWorldConfig | None = None
    """The array of a simulated lenslet camera; None for cameras of one view each."""
    view_errors: dict[str, ViewErrorConfig] = Field(default_factory=dict)
    """By view name: how the true camera differs from the ideal one."""
    eeprom: bool = False
    """Whether a simulated OAK device holds a calibration of its true cameras."""
    carriage: CarriageConfig
    """Mechanics of the stage."""
    firmware: FirmwareConfig = FirmwareConfig()
    """Controller of the stage."""
    slider: SliderConfig | None = None
    """What carries the camera along the row, where it moves."""
    column: SliderConfig | None = None
    """What carries it along the column."""
    lamp: LampConfig = LampConfig()
    """The light."""
    hand: HandConfig = HandConfig()
    """The hand that shows the board where no stage carries it."""
    temperature: TemperatureConfig = TemperatureConfig()
    """Warming of the rig."""
    board_tilt_deg: tuple[float, float] = (0.0, 0.0)
    """Rotation of the board about the x and the y axis of the reference camera."""
    board_offset_mm: tuple[float, float] = (0.0, 0.0)
    """Board centre right of and below the optical axis at machine coordinate 0."""
    board_margin_mm: NotNegative = 15.0
    """White border around the outer squares."""
    board_square_mm: Positive | None = None
    """True size of a square where the print differs from the target's nominal size."""
