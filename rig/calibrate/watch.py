"""What somebody who watches a calibration is told: every look at a target in the hand."""

from collections.abc import Callable
from dataclasses import dataclass

from rig.calibrate.coverage import Coverage
from rig.calibrate.pictures import Picture
from rig.calibrate.sight import PictureSightings
from rig.profile import Profile


@dataclass(frozen=True, slots=True)
class Look:
    """One picture of a target in the hand, kept or not, and what is known so far."""

    profile: Profile
    picture: Picture
    sightings: PictureSightings
    is_moving: bool
    """Whether the target moved since the picture before: such pictures are not kept."""
    kept: int
    """Pictures that are kept."""
    advice: str
    """What to show next."""
    coverage: Coverage | None
    """Of the kept pictures of a target in the hand; None before the first."""
    errors: tuple[tuple[int, float], ...]
    """Of every solve so far: pictures, and the depth error at 1 m that it foretells, k = 2, %."""


Watch = Callable[[Look], None]
"""Told on the thread that takes pictures: it must be quick."""


def unwatched(_look: Look) -> None:
    """Nobody watches."""
