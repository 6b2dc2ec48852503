"""One feature of one camera: looked at before it is set, and read back."""

import math

from rig.errors import ConfigError, ControlError
from rig_genicam.config import FeatureValue
from rig_genicam.door import GenicamDevice, RefusedError

_EXACT_SHARE = 1e-6
"""Numbers go to the camera and back as binary fractions."""


def put(
    device: GenicamDevice,
    feature: str,
    value: FeatureValue,
    *,
    key: str,
    share: float = _EXACT_SHARE,
    unit: str = "",
) -> FeatureValue:
    """Set a feature and return it as it reads back.

    Args:
        device: open.
        feature: its GenICam name.
        value: what it shall be.
        key: of the profile, for messages.
        share: how far the camera may round a number, as a share of it.
        unit: of the feature where it is not that of the key, for messages.

    Raises:
        ConfigError: the camera has no such feature, or the value is not one of its own.
        ControlError: it refuses the value, or applies another one.
    """
    if not device.has(feature):
        raise ConfigError(
            f"{device.name}: asked for {key}, has no {feature} now",
            advice=f"remove {key}; `arv-tool-0.8 features` lists what it has",
        )
    _require_entry(device, feature, value, key)
    _require_inside(device, feature, value, key, f" {unit}" if unit else "")
    try:
        device.write(feature, value)
        applied = device.read(feature)
    except RefusedError as error:
        raise ControlError(
            device.name,
            control=feature,
            wanted=str(value),
            applied=f"nothing ({error})",
            then=f"correct {key}; features may depend on each other: order matters",
        ) from error
    if not _is_same(applied, value, share):
        raise ControlError(
            device.name,
            control=feature,
            wanted=str(value),
            applied=str(applied),
            then=f"ask for that by {key}, or for a value that the camera can keep",
        )
    return applied


def execute(device: GenicamDevice, command: str, *, key: str) -> None:
    """Execute a command.

    Raises:
        ConfigError: the camera has no such command.
        ControlError: it refuses.
    """
    if not device.has(command):
        raise ConfigError(
            f"{device.name}: asked for {key}, has no {command} now",
            advice=f"remove {key}; `arv-tool-0.8 features` lists what it has",
        )
    try:
        device.write(command, True)
    except RefusedError as error:
        raise ControlError(
            device.name,
            control=command,
            wanted="to be executed",
            applied=f"nothing ({error})",
            then=f"correct {key}",
        ) from error


def _require_entry(device: GenicamDevice, feature: str, value: FeatureValue, key: str) -> None:
    entries = device.entries(feature)
    if entries is not None and value not in entries:
        raise ConfigError(
            f"{device.name}: asked for {feature} {value}, offers {', '.join(entries) or 'none'}",
            advice=f"set {key} to one of these",
        )


def _require_inside(
    device: GenicamDevice, feature: str, value: FeatureValue, key: str, unit: str
) -> None:
    bounds = device.bounds(feature)
    if bounds is None:
        return
    if isinstance(value, str | bool):
        raise ConfigError(
            f"{device.name}: asked for {feature} {value!r}, it is a number",
            advice=f"set {key} to a number",
        )
    least, most, step = bounds
    if not least <= value <= most:
        raise ConfigError(
            f"{device.name}: asked for {feature} {value:g}{unit}, it takes {least:g} to "
            f"{most:g}{unit}",
            advice=f"set {key} to a value inside",
        )
    steps = (value - least) / step if step > 0.0 else 0.0
    if float(step).is_integer() and abs(steps - round(steps)) > 1e-9:
        nearest = least + step * min(round(steps), math.floor((most - least) / step))
        raise ConfigError(
            f"{device.name}: asked for {feature} {value:g}, it goes in steps of {step:g} from "
            f"{least:g}",
            advice=f"the nearest is {nearest:g}",
        )


def _is_same(applied: FeatureValue, wanted: FeatureValue, share: float) -> bool:
    if isinstance(wanted, bool | str) or isinstance(applied, bool | str):
        return applied == wanted
    return math.isclose(applied, wanted, rel_tol=share, abs_tol=1e-9)
