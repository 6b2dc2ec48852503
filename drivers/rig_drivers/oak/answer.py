"""What `python -m rig_drivers.oak` answers, as values."""

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


class Failure(BaseModel):
    """What is printed instead of a list."""

    model_config = _CLOSED

    found: str
    advice: str
    installed: bool


_ANSWER: TypeAdapter[list[Answer] | Failure] = TypeAdapter(list[Answer] | Failure)


def parse_answer(text: str, code: int) -> list[Answer]:
    """Return the devices in the last line of an output.

    Args:
        text: standard output.
        code: exit code.

    Raises:
        ConfigError: the extra is not installed.
        DeviceNotFoundError: the search failed.
    """
    lines = text.strip().splitlines()
    try:
        answer = _ANSWER.validate_json(lines[-1] if lines else "")
    except ValidationError as error:
        raise DeviceNotFoundError(
            "OAK", f"DepthAI ended with code {code} and no list of devices", advice="try again"
        ) from error
    if not isinstance(answer, Failure):
        return answer
    if not answer.installed:
        raise ConfigError(answer.found, advice=answer.advice)
    raise DeviceNotFoundError("OAK", answer.found, advice=answer.advice)
