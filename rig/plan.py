"""The sweep as a value: which distances, in which order, in which role."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.errors import ConfigError, StageLimitError
from rig.limits import MOST_STOPS

Role = Literal["fit", "holdout"]
Direction = Literal["forward", "backward"]


@dataclass(frozen=True, slots=True)
class Stop:
    """One halt of the stage, at which all samples of a distance are taken."""

    index: int
    """Place in the order of visits, from 0."""
    distance_mm: float
    role: Role
    """`fit` makes the curve, `holdout` judges it."""
    direction: Direction
    """Whether it belongs to the pass from near to far or to the way back."""


def even_distances_mm(from_mm: float, to_mm: float, count: int) -> tuple[float, ...]:
    """Return `count` evenly spaced distances, both ends included.

    Raises:
        ConfigError: fewer than two distances, or both ends are one place.
    """
    if count < 2 or from_mm == to_mm:
        raise ConfigError(
            f"asked for {count} distances from {from_mm} to {to_mm} mm",
            advice="give two distances or more and two different ends",
        )
    return tuple(float(d) for d in np.linspace(from_mm, to_mm, count))


def plan_stops(
    distances_mm: Sequence[float],
    *,
    holdout_every: int,
    backward_every: int,
    travel_mm: tuple[float, float],
    stage: str,
) -> tuple[Stop, ...]:
    """Order the stops: from near to far, then back at some of them.

    The middle of every `holdout_every` distances is held out, so that the ends, between which the
    curve will be valid, are always fitted. On the way back every `backward_every`-th distance is
    visited again in its first role: the difference shows drift and hysteresis.

    Args:
        distances_mm: distances in any order; each is visited on the forward pass.
        holdout_every: hold one of so many out of the fit; 0 holds none.
        backward_every: visit every so-many-th again on the way back; 0 for none.
        travel_mm: what the stage can reach.
        stage: name of the stage for messages.

    Raises:
        ConfigError: no distance, one that is not a number, the same one twice, or too many.
        StageLimitError: a distance lies outside the travel; nothing has moved.
    """
    if not distances_mm or not all(math.isfinite(d) for d in distances_mm):
        raise ConfigError(
            f"asked for distances {list(distances_mm)} mm", advice="give finite numbers in mm"
        )
    if len(distances_mm) > MOST_STOPS:
        raise ConfigError(
            f"asked for {len(distances_mm)} distances, most are {MOST_STOPS}",
            advice="give fewer; a curve needs some twenty",
        )
    ordered = sorted(float(d) for d in distances_mm)
    for near_mm, far_mm in itertools.pairwise(ordered):
        if near_mm == far_mm:
            raise ConfigError(f"{near_mm} mm is asked for twice", advice="give every distance once")
    for distance_mm in (ordered[0], ordered[-1]):
        if not travel_mm[0] <= distance_mm <= travel_mm[1]:
            raise StageLimitError(stage, wanted_mm=distance_mm, travel_mm=travel_mm)
    last = len(ordered) - 1

    def role(place: int) -> Role:
        held = holdout_every > 0 and place % holdout_every == holdout_every // 2
        return "holdout" if held and 0 < place < last else "fit"

    visits: list[tuple[int, Direction]] = [(place, "forward") for place in range(last + 1)]
    if backward_every > 0:
        again = (place for place in range(last - 1, -1, -1) if place % backward_every == 0)
        visits.extend((place, "backward") for place in again)
    return tuple(
        Stop(index, ordered[place], role(place), direction)
        for index, (place, direction) in enumerate(visits)
    )


def move_time_s(distance_mm: float, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Return how long a move takes that starts and ends at rest (trapezoid of speed)."""
    way_mm = abs(distance_mm)
    ramp_mm = speed_mm_s**2 / acceleration_mm_s2
    if way_mm < ramp_mm:
        return 2.0 * math.sqrt(way_mm / acceleration_mm_s2)
    return way_mm / speed_mm_s + speed_mm_s / acceleration_mm_s2
