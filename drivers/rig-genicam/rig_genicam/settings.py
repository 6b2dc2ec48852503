"""The profile's camera as features of one device: looked for, set in order, and read back."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from rig.errors import ConfigError
from rig_genicam.config import FeatureValue, GenicamCameraConfig, TriggerConfig
from rig_genicam.door import CHUNKS, GenicamDevice
from rig_genicam.feature import execute, put

_US: Final = 1e6
_ROUNDED: Final = 0.01
"""A sensor exposes whole lines and amplifies in steps: 1 % is neither seen nor a mistake."""
_RATE_ROUNDED: Final = 0.005
_EXPOSURES: Final = ("ExposureTime", "ExposureTimeAbs")
"""In us: of the naming convention, and of cameras from before it."""
_GAINS: Final = ("Gain", "GainRaw")
_RATES: Final = ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")
_RATE_SWITCHES: Final = ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled")


@dataclass(frozen=True, slots=True)
class Applied:
    """What a camera was set to, as it reads back."""

    exposure_s: float | None
    """None where the camera decides it itself, or does not tell."""
    has_rate: bool
    """Whether the camera was told the rate; else its frames must show it."""


def apply(device: GenicamDevice, config: GenicamCameraConfig, view: str) -> Applied:
    """Set everything that the profile asks of one camera.

    Args:
        device: open, its stream is not.
        config: the profile's camera.
        view: name of the view.

    Raises:
        ConfigError: the camera has no feature or no value for what is asked.
        ControlError: it refuses a value, or applies another one.
    """
    _untrigger(device)
    _optional(device, "AcquisitionMode", "Continuous")
    put(device, "PixelFormat", config.pixel_format, key="camera.pixel_format")
    _region(device, config)
    exposure_s = _expose(device, config)
    _amplify(device, config)
    has_rate = config.trigger is not None or _pace(device, config)
    own = config.view_features.get(view, {})
    for name, value in (config.features | own).items():
        where = f"view_features.{view}" if name in own else "features"
        _feature(device, name, value, f"camera.{where}.{name}")
    if "ChunkModeActive" not in config.features | own:
        _ask_for_chunks(device)
    if config.trigger is not None:
        _trigger(device, config.trigger)
    return Applied(exposure_s, has_rate)


def _feature(device: GenicamDevice, name: str, value: FeatureValue, key: str) -> None:
    if value is True and device.has(name) and device.is_command(name):
        execute(device, name, key=key)
    else:
        put(device, name, value, key=key, share=_ROUNDED)


def _untrigger(device: GenicamDevice) -> None:
    """A camera keeps what it was set to: every trigger of another program is switched off."""
    if not device.has("TriggerMode"):
        return
    for selector in device.entries("TriggerSelector") or ("",):
        if selector:
            put(device, "TriggerSelector", selector, key="camera.trigger")
        if device.has("TriggerMode"):
            put(device, "TriggerMode", "Off", key="camera.trigger")


def _region(device: GenicamDevice, config: GenicamCameraConfig) -> None:
    for name in ("OffsetX", "OffsetY"):  # or else the old ones limit the new size
        _optional(device, name, 0)
    put(device, "Width", config.width_px, key="camera.width_px")
    put(device, "Height", config.height_px, key="camera.height_px")
    if config.offset_x_px:
        put(device, "OffsetX", config.offset_x_px, key="camera.offset_x_px")
    if config.offset_y_px:
        put(device, "OffsetY", config.offset_y_px, key="camera.offset_y_px")


def _expose(device: GenicamDevice, config: GenicamCameraConfig) -> float | None:
    name = _first(device, _EXPOSURES)
    if config.exposure_s is None:
        automatic = device.has("ExposureAuto") and device.read("ExposureAuto") != "Off"
        return None if name is None or automatic else float(device.read(name)) / _US
    _optional(device, "ExposureMode", "Timed")
    _optional(device, "ExposureAuto", "Off")
    if name is None:
        raise _no(device, "camera.exposure_s", _EXPOSURES)
    applied_us = put(
        device,
        name,
        config.exposure_s * _US,
        key="camera.exposure_s",
        share=_ROUNDED,
        unit="us",
    )
    return float(applied_us) / _US


def _amplify(device: GenicamDevice, config: GenicamCameraConfig) -> None:
    if config.gain is None:
        return
    name = _first(device, _GAINS)
    if name is None:
        raise _no(device, "camera.gain", _GAINS)
    _optional(device, "GainAuto", "Off")
    value = int(config.gain) if name == "GainRaw" and config.gain.is_integer() else config.gain
    put(device, name, value, key="camera.gain", share=_ROUNDED)


def _pace(device: GenicamDevice, config: GenicamCameraConfig) -> bool:
    """Set the rate of a camera that runs freely; return whether there is one to be set."""
    for switch in _RATE_SWITCHES:
        _optional(device, switch, True)
    name = _first(device, _RATES)
    if name is None:
        return False
    put(device, name, config.rate_hz, key="camera.rate_hz", share=_RATE_ROUNDED)
    return True


def _trigger(device: GenicamDevice, trigger: TriggerConfig) -> None:
    if device.has("TriggerSelector"):
        put(device, "TriggerSelector", trigger.selector, key="camera.trigger.selector")
    put(device, "TriggerSource", trigger.source, key="camera.trigger.source")
    if trigger.activation is not None:
        put(device, "TriggerActivation", trigger.activation, key="camera.trigger.activation")
    if trigger.is_software and not device.has("TriggerSoftware"):
        raise _no(device, "camera.trigger.source", ("TriggerSoftware",))
    put(device, "TriggerMode", "On", key="camera.trigger")


def _ask_for_chunks(device: GenicamDevice) -> None:
    """Have time, number and exposure sent along with each picture, where the camera can."""
    if not device.has("ChunkModeActive"):
        return
    put(device, "ChunkModeActive", True, key="camera.features.ChunkModeActive")
    offered = device.entries("ChunkSelector") or ()
    for chunk in CHUNKS:
        if chunk in offered:
            put(device, "ChunkSelector", chunk, key="camera.features.ChunkSelector")
            put(device, "ChunkEnable", True, key="camera.features.ChunkEnable")


def _optional(device: GenicamDevice, feature: str, value: bool | int | str) -> None:
    """Set what most cameras have and what stands in the way where it is set otherwise."""
    if not device.has(feature) or device.read(feature) == value:
        return
    entries = device.entries(feature)
    if entries is None or value in entries:
        put(device, feature, value, key=f"camera.features.{feature}")


def _first(device: GenicamDevice, names: Iterable[str]) -> str | None:
    return next((name for name in names if device.has(name)), None)


def _no(device: GenicamDevice, key: str, names: Iterable[str]) -> ConfigError:
    return ConfigError(
        f"{device.name}: asked for {key}, has no {' or '.join(names)} now",
        advice=f"remove {key}, or set the camera's own feature by camera.features "
        "(`arv-tool-0.8 features` lists them)",
    )
