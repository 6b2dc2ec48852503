"""What the buttons of a page do."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from rig.view.message import Message

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a button does nothing, for the person who presses it."""

    reason: str


@dataclass(frozen=True, slots=True)
class Recording:
    """Starts and stops a recording, from any thread."""

    start: Callable[[], str]
    """Returns one line about it.

    Raises:
        RigError: it cannot be written.
    """
    stop: Callable[[], str]
    """Returns one line about it; harmless where none runs."""
    is_on: Callable[[], bool]


@dataclass(frozen=True, slots=True)
class Actions(Generic[M]):
    """What a run lets a page do."""

    save: Callable[[M], str] | Refusal = Refusal("this run saves nothing")
    """Saves the message that the page shows, returns one line about it.

    Raises:
        RigError: it cannot be written.
    """
    recording: Recording | Refusal = Refusal("this run records nothing")
    put: Callable[[str], str] | Refusal = Refusal("nobody has to put anything anywhere in this run")
    """Takes the reading of somebody who has put the board where it was asked for."""
