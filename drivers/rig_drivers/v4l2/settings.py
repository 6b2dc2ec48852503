"""Exposure, gain, focus and white balance of a profile as the controls of one camera."""

from collections.abc import Iterator

from rig.errors import ConfigError
from rig.profile import V4l2CameraConfig
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.controls import Controls, ControlValue

_EXPOSURE_UNIT_S = 1e-4
_MANUAL_EXPOSURE = 1


def settings_for(
    config: V4l2CameraConfig, view: str, controls: Controls, camera: str
) -> dict[str, ControlValue]:
    """Return every control to be set for a view, automatisms first, trigger last.

    Args:
        config: the profile's camera.
        view: name of the view.
        controls: what its device has.
        camera: names the device in messages.

    Raises:
        ConfigError: the device has no control for what the profile asks.
    """
    named = dict(_named(config, controls, camera))
    return {
        **named,
        **config.controls,
        **config.controls_of(view),
        **config.trigger,
    }


def exposure_of(controls: Controls) -> float | None:
    """Return the exposure in s where it is known: fixed, and counted in a unit of time."""
    exposure = controls.with_number(abi.CID_EXPOSURE_ABSOLUTE)
    automatism = controls.with_number(abi.CID_EXPOSURE_AUTO)
    if exposure is None:
        return None
    if automatism is not None and controls.read(automatism) != _MANUAL_EXPOSURE:
        return None
    return controls.read(exposure) * _EXPOSURE_UNIT_S


def _named(
    config: V4l2CameraConfig, controls: Controls, camera: str
) -> Iterator[tuple[str, ControlValue]]:
    if config.exposure_s is not None:
        units = round(config.exposure_s / _EXPOSURE_UNIT_S)
        if abs(units * _EXPOSURE_UNIT_S - config.exposure_s) > 1e-9 or units < 1:
            raise ConfigError(
                f"camera.exposure_s: asked for {config.exposure_s} s, V4L2 counts in steps of "
                f"{_EXPOSURE_UNIT_S} s",
                advice=f"the nearest is {max(1, units) * _EXPOSURE_UNIT_S:.4f} s",
            )
        yield from _off(controls, abi.CID_EXPOSURE_AUTO, _MANUAL_EXPOSURE)
        yield from _off(controls, abi.CID_EXPOSURE_AUTO_PRIORITY, 0)
        if controls.with_number(abi.CID_EXPOSURE) is not None:
            hint = "its exposure counts in lines of the sensor: set camera.controls.exposure"
        else:
            hint = "its exposure cannot be set: remove camera.exposure_s"
        yield _one_of(controls, (abi.CID_EXPOSURE_ABSOLUTE,), camera, "exposure_s", hint), units
    if config.gain is not None:
        yield from _off(controls, abi.CID_AUTOGAIN, 0)
        numbers = (abi.CID_GAIN, abi.CID_ANALOGUE_GAIN)
        yield _one_of(controls, numbers, camera, "gain"), config.gain
    if config.focus is not None:
        yield from _off(controls, abi.CID_FOCUS_AUTO, 0)
        yield _one_of(controls, (abi.CID_FOCUS_ABSOLUTE,), camera, "focus"), config.focus
    if config.white_balance_k is not None:
        yield from _off(controls, abi.CID_AUTO_WHITE_BALANCE, 0)
        numbers = (abi.CID_WHITE_BALANCE_TEMPERATURE,)
        yield _one_of(controls, numbers, camera, "white_balance_k"), config.white_balance_k


def _off(controls: Controls, number: int, value: int) -> Iterator[tuple[str, ControlValue]]:
    """Yield the setting that ends an automatism, where the device has one."""
    automatism = controls.with_number(number)
    if automatism is not None:
        yield automatism.name, value


def _one_of(
    controls: Controls, numbers: tuple[int, ...], camera: str, key: str, hint: str = ""
) -> str:
    for number in numbers:
        control = controls.with_number(number)
        if control is not None:
            return control.name
    listed = ", ".join(sorted(control.name for control in controls)) or "none at all"
    raise ConfigError(
        f"{camera}: asked for camera.{key}, has no control for it",
        advice=f"{hint or f'remove camera.{key}'} (it has {listed})",
    )
