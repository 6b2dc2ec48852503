"""Faults of the wire and of the machine at random moments, each kind as a recipe."""

import random
from collections.abc import Callable

from rig_sim.wire.faults import (
    BrownOut,
    Delay,
    Drop,
    Duplicate,
    Fault,
    Garble,
    HangUp,
    Lie,
    Silence,
    Split,
    Toward,
    Trip,
)


def _toward(rng: random.Random) -> Toward:
    return rng.choice(("host", "device"))


MAKERS: dict[str, Callable[[int, random.Random], Fault]] = {
    "drop": lambda at, rng: Drop(at, _toward(rng), rng.choice((1, 1, 2, 5, 40))),
    "duplicate": lambda at, rng: Duplicate(at, _toward(rng), rng.choice((1, 1, 2, 30))),
    "garble": lambda at, rng: Garble(
        at, _toward(rng), rng.choice((1, 1, 3, 30)), rng.getrandbits(32)
    ),
    "delay": lambda at, rng: Delay(at, _toward(rng), rng.choice((0.05, 0.5, 2.5, 8.0))),
    "split": lambda at, rng: Split(at, _toward(rng), rng.choice((0.001, 0.01))),
    "silence": lambda at, _: Silence(at),
    "hang up": lambda at, _: HangUp(at),
    "reset": lambda at, _: BrownOut(at),
    "alarm": lambda at, _: Trip(at),
    "lie": lambda at, rng: Lie(at, rng.choice((1, 1, 2, 3))),
}
"""By kind: from the number of bytes that pass before, and a source of chance, to a fault."""

IN_MOTION = ("reset", "alarm", "lie")
"""Kinds that mean most while the carriage moves."""
ENDS_THE_DIALOGUE = ("silence", "hang up", "reset", "alarm")
NO_FAULT = Drop(10**9, "host")
"""A fault that never comes."""
