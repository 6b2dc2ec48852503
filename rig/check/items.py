"""What a check says: one item per question, and all of them together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from rig.errors import RigError

Status = Literal["pass", "warn", "fail", "skip"]
"""`warn`: a sweep will run, and be worse for it. `skip`: not looked at; `found` says why."""


@dataclass(frozen=True, slots=True)
class Item:
    """The answer to one question of the pre-flight."""

    name: str
    """Which question; stable, for programs."""
    status: Status
    found: str
    """What was found, with numbers and units."""
    advice: str = ""
    """What to do; empty where nothing is to be done."""
    numbers: Mapping[str, object] = field(default_factory=dict[str, object])
    """The same numbers for programs: units in the keys, one level deeper by view name."""


def failed(name: str, error: RigError) -> Item:
    """Return the item of a question that an error answers: what was found, and its advice."""
    return Item(name, "fail", error.found, error.advice)


def worst(statuses: Sequence[Status]) -> Status:
    """Return the status that all of these together have."""
    order: tuple[Status, ...] = ("fail", "warn", "pass", "skip")
    for status in order:
        if status in statuses:
            return status
    return "skip"


def graded(value: float, *, warn_above: float, fail_above: float) -> Status:
    """Return the status of a value that should be small; NaN fails."""
    if value <= warn_above:
        return "pass"
    if value <= fail_above:
        return "warn"
    return "fail"
