"""What the pictures of one calibration have shown so far."""

from dataclasses import dataclass, field

from rig.calibrate.pictures import Picture
from rig.calibrate.sight import PictureSightings, Tally, sight
from rig.calibrate.solve import SolveChoices, solve
from rig.errors import TargetError
from rig.geometry.bundle import Calibration
from rig.profile import Profile
from rig.targets import Target


@dataclass(slots=True)
class Collection:
    """Grows picture by picture; touches no device and no file."""

    profile: Profile
    target: Target
    sightings: list[PictureSightings] = field(default_factory=list[PictureSightings])
    """Of the pictures that show the target."""
    tally: Tally = field(init=False)
    devices: dict[str, object] = field(default_factory=dict[str, object])
    """Identity of what took them."""
    temperature_degc: float | None = None
    """Of the camera at the newest picture."""

    def __post_init__(self) -> None:
        self.tally = Tally(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the views."""
        return tuple(view.name for view in self.profile.views)

    @property
    def in_hand(self) -> int:
        """Pictures of a target that no stage carried."""
        return sum(one.stage_mm is None for one in self.sightings)

    def add(self, picture: Picture, sightings: PictureSightings | None = None) -> None:
        """Count a picture.

        Args:
            picture: the next one.
            sightings: what it shows; None looks for the target.
        """
        one = sight(picture, self.target) if sightings is None else sightings
        self.tally.add(one)
        if one.views:
            self.sightings.append(one)
        self.temperature_degc = picture.multiview.temperature_degc

    def solved(self, choices: SolveChoices) -> Calibration:
        """Solve with what there is.

        Raises:
            CalibrationError: the pictures do not determine the geometry.
            TargetError: none shows the target; says why.
        """
        if not self.sightings and self.tally.last is not None:
            raise TargetError(
                f"calibration of {self.profile.name} asked for, the target is in none of "
                f"{self.tally.pictures} pictures",
                advice=f"the last one: {self.tally.last}",
                reason=self.tally.last.reason,
            )
        return solve(self.profile, self.target, self.sightings, choices)
