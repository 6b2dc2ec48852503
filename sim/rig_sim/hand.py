"""A hand that shows the board to the cameras: holds it still, moves on, tilts it to all sides."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import HandConfig, Vector

Array = NDArray[np.float64]

_ANGLE_GRID_DEG = 1e-5
_POSITION_GRID_MM = 5e-4


@dataclass(frozen=True, slots=True)
class Reach:
    """What the hand sees to: the board stays in the picture of the reference camera."""

    focal_px: float
    half_size_px: tuple[float, float]
    """Half width and half height of the picture."""
    half_board_mm: tuple[float, float]


class Hand:
    """Places of a board as a function of time, the same for the same seed.

    Every `move_s + hold_s` it goes to the next of an endless row of random poses.

    Args:
        config: how it moves.
        reach: what it keeps in view.
        seed: of the poses.
    """

    def __init__(self, config: HandConfig, reach: Reach, *, seed: int) -> None:
        self._config = config
        self._reach = reach
        self._seed = seed

    def pose(self, t_s: float) -> tuple[Vector, Vector]:
        """Return the centre, mm, and the Rodrigues vector, deg, of the board at a time from 0."""
        config = self._config
        period_s = config.move_s + config.hold_s
        number = math.floor(t_s / period_s)
        share = min((t_s - number * period_s) / config.move_s, 1.0)
        smooth = share * share * (3.0 - 2.0 * share)
        pose = (1.0 - smooth) * self._stop(number) + smooth * self._stop(number + 1)
        grid = np.repeat([_POSITION_GRID_MM, _ANGLE_GRID_DEG], 3)
        x, y, z, turn_x, turn_y, turn_z = (np.rint(pose / grid) * grid).tolist()
        return (x, y, z), (turn_x, turn_y, turn_z)

    def _stop(self, number: int) -> Array:
        """Pose of one stop: centre, then rotation, (6,)."""
        config, reach = self._config, self._reach
        random = np.random.default_rng([self._seed, number])
        low, high = np.log([config.nearest_mm, config.farthest_mm])
        distance_mm = math.exp(random.uniform(low, high))
        px_per_mm = reach.focal_px / distance_mm
        half_board_px = np.array(reach.half_board_mm) * px_per_mm
        room_px = np.maximum(np.array(reach.half_size_px) - half_board_px, 0.0)
        across_mm = random.uniform(-1.0, 1.0, 2) * room_px / px_per_mm
        around_rad, tilt_deg = random.uniform(0.0, 2.0 * np.pi), random.uniform(0, config.tilt_deg)
        tilt = tilt_deg * np.array([np.cos(around_rad), np.sin(around_rad)])
        roll_deg = random.uniform(-config.roll_deg, config.roll_deg)
        return np.array([*across_mm, distance_mm, *tilt, roll_deg])
