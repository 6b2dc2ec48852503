"""Look for the target in every view of a picture."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from rig.calibrate.light import Brightness, brightness_of
from rig.calibrate.pictures import Picture
from rig.errors import TargetError
from rig.frames import Frame
from rig.geometry.sighting import Sighting
from rig.targets import Detection, Target, find_target


@dataclass(frozen=True, slots=True)
class PictureSightings:
    """What one picture shows of the target; the picture itself is let go."""

    number: int
    stage_mm: float | None
    sizes_px: tuple[tuple[int, int], ...]
    """(width, height) of each view."""
    by_view: tuple[Detection | TargetError, ...]
    """Per view: the corners, or why there are none."""
    brightness: tuple[Brightness, ...] = ()
    """Per view: how bright the parts of the picture are; none where nobody looked."""
    places_mm: tuple[tuple[float, ...], ...] | None = None
    """Per view: where the stages stood that carry the camera, read back; None where it stands."""
    time_s: float | None = None
    """Middle of the exposure on the camera's clock; None where nobody knows it."""

    @property
    def sightings(self) -> tuple[Sighting, ...]:
        """Of the views that show it."""
        return tuple(
            Sighting(self.number, view, points.ids, points.xy_px, points.sigma_px)
            for view, points in enumerate(self.by_view)
            if isinstance(points, Detection)
        )

    @property
    def views(self) -> tuple[int, ...]:
        """Views that show it."""
        return tuple(v for v, points in enumerate(self.by_view) if isinstance(points, Detection))


@dataclass(slots=True)
class Tally:
    """How often the target was found, and why it was not."""

    names: tuple[str, ...]
    pictures: int = 0
    found: list[int] = field(default_factory=list[int])
    reasons: list[Counter[str]] = field(default_factory=list[Counter[str]])
    last: TargetError | None = None
    """The latest reason in full."""

    def __post_init__(self) -> None:
        self.found = [0] * len(self.names)
        self.reasons = [Counter() for _ in self.names]

    def add(self, sightings: PictureSightings) -> None:
        """Count one picture."""
        self.pictures += 1
        for view, answer in enumerate(sightings.by_view):
            if isinstance(answer, TargetError):
                self.reasons[view][answer.reason] += 1
                self.last = answer
            else:
                self.found[view] += 1


def sight(picture: Picture, target: Target) -> PictureSightings:
    """Look for the target in all views of a picture."""
    frames = picture.multiview.frames
    return PictureSightings(
        picture.number,
        picture.stage_mm,
        tuple((frame.image.shape[1], frame.image.shape[0]) for frame in frames),
        tuple(_look(frame, target) for frame in frames),
        tuple(map(brightness_of, frames)),
        _places_mm(picture),
        picture.multiview.timestamp_s,
    )


def _places_mm(picture: Picture) -> tuple[tuple[float, ...], ...] | None:
    scan = picture.multiview.scan
    if scan is None:
        return None
    by_view = scan.facts.positions_mm
    return tuple(
        tuple(place for place in by_view[frame.view] if place is not None)
        for frame in picture.multiview.frames
    )


def _look(frame: Frame, target: Target) -> Detection | TargetError:
    try:
        return find_target(frame.image, target)
    except TargetError as error:
        return error


def all_sightings(pictures: Sequence[PictureSightings]) -> list[Sighting]:
    """Return the sightings of many pictures."""
    return [sighting for one in pictures for sighting in one.sightings]
