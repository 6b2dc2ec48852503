"""What a stage's program answers: one line of JSON."""

import json
from dataclasses import dataclass
from typing import Any

LONGEST_ANSWER = 10_000
"""Characters; more is no answer."""
MILLION_MM = 1e6


@dataclass(frozen=True, slots=True)
class Answer:
    """One line of a program."""

    position_mm: float | None = None
    """Where the stage is; None where the program does not know, or was not asked."""
    is_stopped: bool = False
    """Whether it says that the stage stands."""
    error: str | None = None
    """What went wrong, in its own words."""


class NoAnswerError(Exception):
    """What a program said is no answer; the text says why."""


def read_answer(output: str) -> Answer:
    """Return what a program's output means.

    Args:
        output: all that it wrote: one line with an object, `{"position_mm": 400.0}` (or null),
            `{"stopped": true}` or `{"error": "..."}`.

    Raises:
        NoAnswerError: it is something else.
    """
    lines = output.split("\n") if len(output) <= LONGEST_ANSWER else []
    said = [line for line in lines if line.strip()]
    if len(said) != 1:
        raise NoAnswerError(f"{len(said)} lines" if lines else f"{len(output)} characters")
    try:
        found: Any = json.loads(said[0])
    except (ValueError, RecursionError) as error:
        raise NoAnswerError(f"{said[0][:80]!r}, which is no JSON") from error
    match found:
        case {"error": str(text)} if len(found) == 1:
            return Answer(error=text)
        case {"stopped": True} if len(found) == 1:
            return Answer(is_stopped=True)
        case {"position_mm": None} if len(found) == 1:
            return Answer()
        case {"position_mm": int() | float() as position} if len(found) == 1:
            return Answer(position_mm=_checked_mm(position))
        case _:
            raise NoAnswerError(f"{said[0][:80]!r}")


def _checked_mm(position: float) -> float:
    if isinstance(position, bool) or not abs(position) <= MILLION_MM:
        raise NoAnswerError(f"a position of {position!r} mm")
    return float(position)
