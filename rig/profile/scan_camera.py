"""A camera that a stage carries: one lens, and the positions from which it looks."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Literal, Self

from pydantic import Field, ValidationError, model_validator

from rig.profile.by_kind import InnerCameraSection
from rig.profile.cameras import CameraConfig
from rig.profile.model import Model, NotNegative, Positive
from rig.profile.views import ViewConfig

REFERENCE = "reference"
"""Name of the view from which depth is measured."""
_SAME_MM = 1e-6
_SAME_STEPS = 1e-6
_TYPICAL_MOVE_S = 1.0


_ANY_VIEWS = (
    ViewConfig(name=REFERENCE, x_steps=0.0, y_steps=0.0),
    ViewConfig(name="other", x_steps=1.0, y_steps=0.0),
)


class ScanPathConfig(Model):
    """Where a carrier halts: at positions of its own scale, even or uneven."""

    at_mm: tuple[float, ...] | None = None
    """Positions, growing; one of them is `reference_mm`. In place of `from_mm`, `to_mm`, `count`.
    """
    from_mm: float | None = None
    """First position of an even path."""
    to_mm: float | None = None
    """Last position of an even path."""
    count: int | None = Field(default=None, ge=2)
    """How many positions an even path has, both ends included."""
    reference_mm: float = 0.0
    """The position of the reference view."""

    @property
    def positions_mm(self) -> tuple[float, ...]:
        """All positions, growing."""
        if self.at_mm is not None:
            return self.at_mm
        if self.from_mm is None or self.to_mm is None or self.count is None:
            raise AssertionError  # validated
        step_mm = (self.to_mm - self.from_mm) / (self.count - 1)
        return tuple(self.from_mm + i * step_mm for i in range(self.count))

    def named(self, letter: str) -> tuple[tuple[str, float], ...]:
        """Return the view at every position, and the position.

        Args:
            letter: names begin with it, but for the reference.
        """
        return tuple(
            (REFERENCE if abs(place - self.reference_mm) <= _SAME_MM else f"{letter}{n}", place)
            for n, place in enumerate(self.positions_mm)
        )

    @model_validator(mode="after")
    def _one_path_with_its_reference(self) -> Self:
        even = (self.from_mm, self.to_mm, self.count)
        if (self.at_mm is None) == (even == (None, None, None)) or (
            self.at_mm is None and None in even
        ):
            raise ValueError("give at_mm, or from_mm, to_mm and count")
        places = self.positions_mm
        if len(places) < 2 or any(b - a <= _SAME_MM for a, b in pairwise(places)):
            raise ValueError(f"positions must grow, at least two, found {_in_words(places)}")
        if sum(abs(place - self.reference_mm) <= _SAME_MM for place in places) != 1:
            raise ValueError(
                f"reference_mm = {self.reference_mm:g} is none of the positions {_in_words(places)}"
            )
        return self


class ScanCameraConfig(CameraConfig):
    """One camera on a stage: a multi-view is a scan, its views are taken one after the other.

    The stage is `[stages.camera]`; a second one across it, `[stages.column]`, gives the V column.
    Positions are those of the stages. `views` of the profile follow from them.
    """

    kind: Literal["scan"]
    """Selects the camera that moves."""
    timeout_s: Positive = 900.0
    """Longest wait for one scan."""
    row: ScanPathConfig
    """Positions of `[stages.camera]`; growing ones lie to the right."""
    column: ScanPathConfig | None = None
    """Positions of `[stages.column]`; growing ones lie below."""
    inner: InnerCameraSection
    """The camera that is carried: any kind, with one view."""
    settle_s: NotNegative = 2.0
    """Pause between the end of a move and the exposure; `rig check` measures how long it must be.
    """
    move_timeout_s: Positive = 60.0
    """Longest wait for one move."""
    max_motion_px: Positive = 0.1
    """Largest motion of the scene between takes of the reference; a scan with more is refused."""

    @property
    def is_scan(self) -> bool:
        """See `CameraConfig.is_scan`."""
        return True

    @property
    def is_simulated(self) -> bool:
        """See `CameraConfig.is_simulated`."""
        return self.inner.is_simulated

    @property
    def needs_real_time(self) -> bool:
        """See `CameraConfig.needs_real_time`."""
        return self.inner.needs_real_time

    @property
    def size_px(self) -> tuple[int, int] | None:
        """See `CameraConfig.size_px`."""
        return self.inner.size_px

    @property
    def typical_grab_s(self) -> float:
        """See `CameraConfig.typical_grab_s`."""
        takes = len(self.views_at(1.0)) + 2
        return takes * (self.settle_s + self.inner.typical_grab_s + _TYPICAL_MOVE_S)

    @property
    def inner_view(self) -> ViewConfig:
        """The one view of the camera that is carried."""
        names = [name for table in self.inner.by_view.values() for name in table]
        return ViewConfig(name=names[0] if names else "camera", x_steps=0.0, y_steps=0.0)

    def views_at(self, pitch_mm: float) -> tuple[ViewConfig, ...]:
        """Return the views of a profile: the reference first, then the row and the column.

        Args:
            pitch_mm: length of one view step.
        """
        views = [ViewConfig(name=REFERENCE, x_steps=0.0, y_steps=0.0)]
        for name, place_mm in self.row.named("h"):
            steps = (place_mm - self.row.reference_mm) / pitch_mm
            if name != REFERENCE:
                views.append(ViewConfig(name=name, x_steps=steps, y_steps=0.0))
        if self.column is not None:
            for name, place_mm in self.column.named("v"):
                steps = (place_mm - self.column.reference_mm) / pitch_mm
                if name != REFERENCE:
                    views.append(ViewConfig(name=name, x_steps=0.0, y_steps=steps))
        return tuple(views)

    @model_validator(mode="after")
    def _one_live_view(self) -> Self:
        if self.inner.is_stored:
            raise ValueError(
                f"inner camera of kind {self.inner.kind} holds stored pictures; give one to carry"
            )
        odd = [key for key, table in self.inner.by_view.items() if len(table) != 1]
        if odd:
            raise ValueError(f"the camera that is carried has one view; inner.{odd[0]} names more")
        return self


def scan_views(data: Mapping[str, object]) -> tuple[ViewConfig, ...] | None:
    """Return the views that the plain data of a profile imply, None where they imply none.

    Of a scan that cannot be any views do: what is wrong with it is told at its own section.
    """
    camera, pitch_mm = data.get("camera"), data.get("pitch_mm")
    if isinstance(camera, Mapping) and camera.get("kind") == "scan":
        try:
            camera = ScanCameraConfig.model_validate(camera)
        except ValidationError:
            return _ANY_VIEWS
    if not isinstance(camera, ScanCameraConfig) or not isinstance(pitch_mm, (int, float)):
        return None
    return camera.views_at(float(pitch_mm)) if pitch_mm > 0 else None


def same_views(found: tuple[ViewConfig, ...], implied: tuple[ViewConfig, ...]) -> bool:
    """Whether views that are written down are those that positions imply."""
    return len(found) == len(implied) and all(
        a.name == b.name
        and abs(a.x_steps - b.x_steps) <= _SAME_STEPS
        and abs(a.y_steps - b.y_steps) <= _SAME_STEPS
        for a, b in zip(found, implied, strict=True)
    )


def _in_words(places: tuple[float, ...]) -> str:
    return ", ".join(f"{place:g}" for place in places)
