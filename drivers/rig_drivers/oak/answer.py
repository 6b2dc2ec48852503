"""What `python -m rig_drivers.oak` answers, as values."""

from typing import TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from rig.errors import ConfigError, DeviceNotFoundError

# Not `rig.profile.model.Model`: all profiles would come with it, and `rig devices` has no time.
_CLOSED = ConfigDict(extra="forbid", frozen=True)


class Answer(BaseModel):
    """One device as it is printed; see `FoundOak`."""

    model_config = _CLOSED

    device_id: str
    name: str
    protocol: str
    problem: str | None


class SensorAnswer(BaseModel):
    """One sensor of a device as it is printed; see `described_sensors`."""

    model_config = _CLOSED

    socket: str
    """Such as `CAM_A`."""
    name: str
    """Of the chip, such as `OV9282`."""
    sizes_px: tuple[tuple[int, int], ...]
    """Width and height of its pictures."""
    has_colour: bool
    has_autofocus: bool
    place_mm: tuple[float, float, float] | None
    """Optical centre in the frame of the first sensor; None where the device does not know it."""


class Failure(BaseModel):
    """What is printed instead of a list."""

    model_config = _CLOSED

    found: str
    advice: str
    installed: bool


_ANSWER: TypeAdapter[list[Answer] | Failure] = TypeAdapter(list[Answer] | Failure)
_SENSORS: TypeAdapter[list[SensorAnswer] | Failure] = TypeAdapter(list[SensorAnswer] | Failure)
Listed = TypeVar("Listed", Answer, SensorAnswer)


def parse_answer(text: str, code: int) -> list[Answer]:
    """Return the devices in the last line of an output.

    Args:
        text: standard output.
        code: exit code.

    Raises:
        ConfigError: the extra is not installed.
        DeviceNotFoundError: the search failed.
    """
    return _parsed(_ANSWER, text, code, "list of devices")


def parse_sensors(text: str, code: int) -> list[SensorAnswer]:
    """Return the sensors of one device in the last line of an output; see `parse_answer`."""
    return _parsed(_SENSORS, text, code, "list of sensors")


def _parsed(
    adapter: "TypeAdapter[list[Listed] | Failure]", text: str, code: int, wanted: str
) -> list[Listed]:
    lines = text.strip().splitlines()
    try:
        answer = adapter.validate_json(lines[-1] if lines else "")
    except ValidationError as error:
        raise DeviceNotFoundError(
            "OAK", f"DepthAI ended with code {code} and no {wanted}", advice="try again"
        ) from error
    if not isinstance(answer, Failure):
        return answer
    if not answer.installed:
        raise ConfigError(answer.found, advice=answer.advice)
    raise DeviceNotFoundError("OAK", answer.found, advice=answer.advice)
