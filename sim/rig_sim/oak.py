"""Simulated sensors for a DepthAI pipeline without a device: what each would send, in real time."""

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rig.factory import FactoryCamera
from rig.frames import ColourImage, GreyImage
from rig.profile import OakCameraConfig
from rig_sim.noise import ViewExposure
from rig_sim.optics import TrueCamera
from rig_sim.pictures import Exposures
from rig_sim.world import World

_TEN_BITS = 1023


@dataclass(frozen=True, slots=True)
class SensorFaults:
    """What is wrong with one sensor."""

    jitter_s: float = 0.0
    """Standard deviation of the start of exposures; never more than a fifth of a period away."""
    drop_share: float = 0.0
    """Share of frames that are lost on the way."""
    stalls_after: int | None = None
    """After so many frames nothing comes any more."""
    raises_after: int | None = None
    """After so many frames its code fails."""
    exposure_ratio: float = 1.0
    """Applied exposure over the one asked for: a sensor that clips."""
    iso: int | None = None
    """Applied gain, where it is not the one asked for."""
    phase_s: float = 0.0
    """Offset of all its exposures: no synchronisation."""
    controls_after: int = 0
    """For so many frames the automatics are still at work."""


@dataclass(frozen=True, slots=True)
class SimSensorFrame:
    """One frame, with what its sensor reports."""

    image: GreyImage
    timestamp_s: float
    sequence: int
    exposure_s: float
    iso: int
    lens_position: int
    white_balance_k: int
    temperature_degc: float | None
    colour: ColourImage | None = None


class SimOakRack:
    """All sensors of a simulated OAK camera, in step with each other, looking at the World.

    Args:
        config: the profile's camera: rate, exposure and controls that the sensors obey.
        world: its clock must be the real one, CLOCK_MONOTONIC.
        faults: by view name.
        device: tells it from other devices of the rig.
        views: of this device; None for all.
    """

    def __init__(
        self,
        config: OakCameraConfig,
        world: World,
        faults: Mapping[str, SensorFaults] | None = None,
        *,
        device: str = "sim://oak",
        views: tuple[str, ...] | None = None,
    ) -> None:
        self._config = config
        self._world = world
        self._faults = dict(faults or {})
        self._device = device
        self._views = views
        pixels = {config.of(view).pixels for view in config.sockets}
        self._light = _Light(world, in_colour="nv12" in pixels)

    @property
    def serial(self) -> str:
        """Name of the simulated rig and of the device."""
        return f"{self._world.profile.name} {self._device.removeprefix('sim://')}"

    @property
    def factory_calibration(self) -> tuple[FactoryCamera, ...] | None:
        """The true cameras as its EEPROM holds them; None where the world leaves it empty."""
        if not self._world.config.eeprom:
            return None
        names = [view.name for view in self._world.profile.views]
        cameras = dict(zip(names, self._world.moment(0.0).cameras, strict=True))
        first, *_ = chosen = [
            cameras[name] for name in names if self._views is None or name in self._views
        ]
        return tuple(factory_camera(camera, first) for camera in chosen)

    def sources(self) -> Mapping[str, "SimSensor"]:
        """Return the sensors by view name, switched on now."""
        self._light.on(0, self._world.clock.now_s())  # the first drawing takes longest
        began_s = self._first_pulse_s(self._world.clock.now_s())
        return {
            view.name: SimSensor(
                self._config.of(view.name),
                self._world,
                self._light,
                number=number,
                began_s=began_s,
                faults=self._faults.get(view.name, SensorFaults()),
            )
            for number, view in enumerate(self._world.profile.views)
            if self._views is None or view.name in self._views
        }

    def _first_pulse_s(self, now_s: float) -> float:
        """Return when frame 0 begins: now, or with the next pulse that all devices get."""
        if self._config.sync not in ("external", "ptp"):
            return now_s
        return math.ceil(now_s * self._config.rate_hz) / self._config.rate_hz


def factory_camera(camera: TrueCamera, first: TrueCamera) -> FactoryCamera:
    """Return a true camera as an EEPROM tells it, in single precision.

    Args:
        camera: the view.
        first: the view whose frame places are told in.
    """
    away_mm = np.asarray(camera.position_mm) - np.asarray(first.position_mm)
    f, (cx, cy) = camera.focal_px, camera.centre_px
    return FactoryCamera(
        camera.view,
        camera.width_px,
        camera.height_px,
        _single(((f, 0.0, cx), (0.0, f, cy), (0.0, 0.0, 1.0))),
        tuple(np.float32(k).item() for k in camera.distortion),
        False,
        _single(first.rotation.T @ camera.rotation),
        tuple(np.float32(x).item() for x in first.rotation.T @ away_mm),
    )


def _single(matrix: ArrayLike) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in np.asarray(matrix, np.float32).tolist())


class _Light:
    """The exposures of all views, drawn once for all sensors."""

    def __init__(self, world: World, *, in_colour: bool) -> None:
        self._exposures = Exposures(world, in_colour=in_colour)
        self._lock = threading.Lock()

    def on(self, number: int, t_s: float) -> ViewExposure:
        """Return the exposure of one view in the middle of its frame."""
        with self._lock:
            return self._exposures.at(t_s)[number]


@dataclass(slots=True)
class SimSensor:
    """One sensor; used by one thread."""

    _config: OakCameraConfig
    _world: World
    _light: _Light
    number: int
    """Of its view in the profile."""
    began_s: float
    """When its frame 0 began."""
    faults: SensorFaults
    _sequence: int = 0
    _sent: int = 0
    _random: np.random.Generator = field(init=False)
    _jitter_s: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self._random = np.random.default_rng((self._world.config.seed, self.number))

    def next_frame(self, wait_s: float) -> SimSensorFrame | None:
        """Return the next frame when its exposure has ended, None if that is after `wait_s`."""
        clock, faults = self._world.clock, self.faults
        if faults.raises_after is not None and self._sent >= faults.raises_after:
            raise RuntimeError(f"sensor fault after {self._sent} frames")
        if faults.stalls_after is not None and self._sent >= faults.stalls_after:
            clock.sleep_s(wait_s)
            return None
        start_s = self._start_s()
        exposure_s = self._config.exposure_s * faults.exposure_ratio
        left_s = start_s + exposure_s - clock.now_s()
        if left_s > wait_s:
            clock.sleep_s(wait_s)
            return None
        clock.sleep_s(left_s)
        frame = None
        if self._random.random() >= faults.drop_share:
            frame = self._frame(start_s + exposure_s / 2.0, exposure_s)
            self._sent += 1
        self._advance()
        return frame

    def _start_s(self) -> float:
        period_s = 1.0 / self._config.rate_hz
        return self.began_s + self.faults.phase_s + self._jitter_s + self._sequence * period_s

    def _advance(self) -> None:
        """Go to the next frame that is still ahead: a slow computer loses frames, not time."""
        period_s = 1.0 / self._config.rate_hz
        behind_s = self._world.clock.now_s() - self._start_s() - period_s
        self._sequence += 1 + max(0, int(behind_s / period_s))
        spread_s = self.faults.jitter_s
        limit_s = 0.2 * period_s
        self._jitter_s = float(np.clip(self._random.normal(0.0, spread_s), -limit_s, limit_s))

    def _frame(self, middle_s: float, exposure_s: float) -> SimSensorFrame:
        config = self._config
        seed = (self._world.config.seed, self.number, self._sequence)
        exposure = self._light.on(self.number, middle_s)
        image = exposure.grey.draw(seed)
        if config.pixels == "raw10":
            image = _ten_bits(image)
        is_auto = self._sent < self.faults.controls_after
        return SimSensorFrame(
            image,
            middle_s,
            self._sequence,
            exposure_s * (1.5 if is_auto else 1.0),
            config.iso if self.faults.iso is None else self.faults.iso,
            -1 if config.lens_position is None else config.lens_position,
            config.white_balance_k or 0,
            self._world.temperature_degc(middle_s),
            exposure.colour(seed) if config.pixels == "nv12" else None,
        )


def _ten_bits(image: GreyImage) -> GreyImage:
    """Return the same light in ten bits."""
    full = float(np.iinfo(image.dtype).max)
    return np.round(image * (_TEN_BITS / full)).astype(np.uint16)
