"""What a page may say to the run that it looks at: JSON, one object a message, nothing else."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rig.errors import FormatError

Extra = Literal["views", "sigma", "label", "slope", "rectified", "colour", "drift"]
"""What a page may ask for beside the map itself: it costs only who looks at it."""
Deed = Literal["save", "record", "stop", "put"]
MOST_BYTES = 2048
"""No command is longer."""


class Command(BaseModel):
    """One message of a page; any of these may be absent."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    ack: Annotated[int, Field(ge=0)] | None = None
    """Number of a message that has been drawn: the next one may come."""
    want: frozenset[Extra] | None = None
    """What later messages are to hold."""
    freeze: bool | None = None
    """Whether the page keeps the picture that it shows, and takes no other."""
    do: Deed | None = None
    """What to do with the message `ack`, or with the run."""
    reading: Annotated[str, Field(max_length=20)] = ""
    """With `put`: where the board stands as somebody has read it; empty: where it should."""


def parse(text: str | bytes) -> Command:
    """Return the command of a message.

    Raises:
        FormatError: it is none.
    """
    try:
        return Command.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise FormatError(
            f"no command of the live page: {where and where + ': '}{first['msg']}",
            advice="use the page that the server gives",
        ) from error
