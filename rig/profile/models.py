"""A profile: one rig, described completely, as it stands on the bench."""

from collections.abc import Mapping
from typing import Self

from pydantic import Field, model_validator

from rig.errors import ConfigError
from rig.limits import MOST_SAMPLES, MOST_STOPS
from rig.profile.by_kind import CameraSection, StageSection
from rig.profile.intrinsics import IntrinsicsConfig
from rig.profile.model import Model, NotNegative, Positive, Span
from rig.profile.processing import ProcessingConfig
from rig.profile.scan_camera import ScanCameraConfig, same_views, scan_views
from rig.profile.stages import SerialStageConfig, StageConfig
from rig.profile.targets import TargetConfig
from rig.profile.views import ViewConfig, without_steps
from rig.profile.world import WorldConfig


class SweepConfig(Model):
    """The sweep when the command line does not say otherwise."""

    from_mm: Positive
    """First distance, visited."""
    to_mm: Positive
    """Last distance, visited."""
    count: int = Field(default=17, ge=2, le=MOST_STOPS)
    """How many distances, both ends included."""
    samples: int = Field(default=5, ge=1, le=MOST_SAMPLES)
    """Multi-views per stop."""
    holdout_every: int = Field(default=4, ge=0)
    """Every so-many-th distance is kept out of the fit and judges it; 0 keeps none."""
    backward_every: int = Field(default=4, ge=0)
    """On the way back every so-many-th distance is measured again; 0 for none."""
    settle_s: NotNegative = 0.4
    """Pause between the end of a move and the first exposure."""
    max_motion_px: Positive = 0.1
    """Largest corner motion between the first and the last sample of a stop."""
    move_timeout_s: Positive = 60.0
    """Longest wait for one move."""


class SlopeConfig(Model):
    """What the scene can have: its distances, or its slopes; one of the two."""

    range_px: Span | None = None
    """Smallest and largest slope to look for, px per view step."""
    range_mm: tuple[Positive, Positive] | None = None
    """Nearest and farthest distance to look for; slopes follow from the calibration or the curve of
    the run, and outside there is no depth."""
    colour: bool = False
    """Whether captures measure slopes in colour, for which all views must have it. It finds texture
    that is of one brightness, is worse than grey on mosaics, and takes longer, the more so live;
    sweeps measure in grey."""

    @model_validator(mode="after")
    def _one_range_that_has_a_length(self) -> Self:
        if (self.range_px is None) == (self.range_mm is None):
            raise ValueError(
                f"{'neither' if self.range_px is None else 'both'} of range_px and range_mm given; "
                "give range_mm = [nearest, farthest], or range_px where no calibration is known"
            )
        for key, span in (("range_px", self.range_px), ("range_mm", self.range_mm)):
            if span is not None and not span[0] < span[1]:
                raise ValueError(f"{key} runs from {span[0]} to {span[1]}; give smallest, largest")
        return self


class PriorSigmaConfig(Model):
    """How sure a geometric calibration is that comes without a covariance, 1 sigma."""

    focal_pct: NotNegative
    """Focal length of each view, per cent."""
    baseline_pct: NotNegative
    """Place of each view, per cent of its distance from the reference."""
    turn_deg: NotNegative
    """Orientation of each view against the reference, about each axis; a principal point that is
    off counts as a turn."""


class QualityConfig(Model):
    """Gates: a run that misses one ends with exit code 3."""

    holdout_rms_pct: Positive = 0.2
    """Largest rms depth error at held-out distances, per cent of the distance."""
    holdout_max_pct: Positive = 0.5
    """Largest depth error at any held-out distance, per cent."""
    line_rms_px: Positive = 0.5
    """Largest rms distance of corners from their epipolar lines; more means views that are not
    rectified, and wrong depth away from the board's centre."""
    depth_sigma_pct: Positive = 1.0
    """Largest 1 sigma of a pixel's depth, per cent of the depth; a pixel above has no answer."""
    valid_share_pct: NotNegative = 50.0
    """Least share of pixels with a depth in a capture, per cent."""


class StagesConfig(Model):
    """The stages of a rig by what they carry, where there are more than that of the board.

    `[stages.board]` is another way to write `[stage]`.
    """

    camera: StageSection | None = None
    """Carries the camera of a scan along its row."""
    column: StageSection | None = None
    """Carries it along its column."""

    @model_validator(mode="after")
    def _the_camera_is_carried(self) -> Self:
        for name, stage in self.carriers.items():
            if stage.carries != "camera":
                raise ValueError(f'stages.{name} moves the camera; write carries = "camera" there')
        if self.column is not None and self.camera is None:
            raise ValueError("stages.column needs stages.camera, which carries the row")
        return self

    @property
    def carriers(self) -> Mapping[str, StageConfig]:
        """By name, those that there are: of the row, then of the column."""
        named = {"camera": self.camera, "column": self.column}
        return {name: stage for name, stage in named.items() if stage is not None}


class Profile(Model):
    """One rig: camera, views, stage, target and the defaults of its runs."""

    name: str = Field(min_length=1, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")
    """Name of the rig; curves belong to it."""
    unit: str = Field(default="", max_length=80, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")
    """Which of several rigs of this name it is; empty: the serial number of its camera. Curves and
    calibrations of another unit are not used by themselves."""
    description: str = ""
    """One line for `rig profile list`."""
    pitch_mm: Positive
    """Length of one view step."""
    views: tuple[ViewConfig, ...] = Field(min_length=1)
    """All views; exactly one of them, the reference, is at (0, 0). One alone, for `rig calibrate`,
    has no steps and no slopes: leave them and `pitch_mm` out."""
    camera: CameraSection
    """Where images come from."""
    stage: StageSection | None = None
    """What carries the board; not needed for capture."""
    stages: StagesConfig = StagesConfig()
    """What carries the camera, where it moves."""
    target: TargetConfig | None = None
    """The board; not needed for capture."""
    sweep: SweepConfig | None = None
    """The sweep; not needed for capture."""
    slopes: SlopeConfig
    """Search range of the dense estimator."""
    processing: ProcessingConfig = ProcessingConfig()
    """What captures do to slopes and depth once they are measured."""
    intrinsics: IntrinsicsConfig | None = None
    """Focal lengths as stated; for calibrations from a scene."""
    prior_sigma: PriorSigmaConfig | None = None
    """For a calibration without a covariance; by default as its source is known to be."""
    quality: QualityConfig = QualityConfig()
    """Limits of a good run."""
    world: WorldConfig | None = None
    """The simulated rig's truth; only for `kind = "sim"` cameras and `sim://` ports."""

    @model_validator(mode="before")
    @classmethod
    def _short_forms(cls, data: object) -> object:
        """Let `[stages.board]` be `[stage]`, and what is left out of views follow."""
        if not isinstance(data, dict):
            return data
        full: dict[str, object] = dict(data)
        stages = full.get("stages")
        if isinstance(stages, dict) and "board" in stages:
            if full.get("stage") is not None:
                raise ValueError("stage and stages.board are both given; give one of them")
            full["stage"] = stages["board"]
            full["stages"] = {name: stages[name] for name in stages if name != "board"}
        if "views" not in full and (views := scan_views(full)) is not None:
            full["views"] = views
        return without_steps(full)

    @model_validator(mode="after")
    def _a_scan_has_its_stages(self) -> Self:
        camera, carriers = self.camera, self.stages.carriers
        if self.stage is not None and self.stage.carries != "board":
            raise ValueError("stage carries the board; a stage of the camera is stages.camera")
        if not isinstance(camera, ScanCameraConfig):
            if carriers:
                raise ValueError(
                    f'stages.camera carries a camera of kind "scan", found {camera.kind!r}'
                )
            return self
        paths = {"camera": camera.row} | ({"column": camera.column} if camera.column else {})
        if list(carriers) != list(paths):
            raise ValueError(
                f"a scan along {len(paths)} axes needs stages.{' and stages.'.join(paths)}, found "
                f"{', '.join(carriers) or 'none'}"
            )
        for name, path in paths.items():
            low_mm, high_mm = carriers[name].travel_mm
            if not low_mm <= path.positions_mm[0] <= path.positions_mm[-1] <= high_mm:
                raise ValueError(
                    f"positions {path.positions_mm[0]:g}..{path.positions_mm[-1]:g} mm leave "
                    f"stages.{name}.travel_mm {low_mm:g}..{high_mm:g} mm"
                )
        if not same_views(self.views, camera.views_at(self.pitch_mm)):
            raise ValueError("views are not those of the positions of the scan; leave views out")
        return self

    @model_validator(mode="after")
    def _each_stage_has_its_port(self) -> Self:
        # A port is held by the stage that opens it first; the second one would fail on the bench.
        named = {"stages.board": self.stage}
        named |= {f"stages.{name}": stage for name, stage in self.stages.carriers.items()}
        holder: dict[str, str] = {}
        for name, stage in named.items():
            if not isinstance(stage, SerialStageConfig):
                continue
            other = holder.setdefault(stage.port, name)
            if other != name:
                raise ValueError(
                    f"{other} and {name} are both at {stage.port}; two axes of one controller are "
                    "not supported, give each stage a controller with a port of its own"
                )
        return self

    @model_validator(mode="after")
    def _views_make_sense(self) -> Self:
        names = [view.name for view in self.views]
        if len(set(names)) != len(names):
            raise ValueError(f"view names must differ, found {', '.join(names)}")
        at_origin = [v.name for v in self.views if v.x_steps == 0.0 and v.y_steps == 0.0]
        if len(at_origin) != 1:
            raise ValueError(
                f"exactly one view must be at x_steps = 0, y_steps = 0 (the reference), "
                f"found {len(at_origin)}"
            )
        return self

    @model_validator(mode="after")
    def _parts_belong_together(self) -> Self:
        names = {view.name for view in self.views}
        for key, by_view in self.camera.by_view.items():
            if set(by_view) != names:
                odd = ", ".join(sorted(set(by_view) ^ names))
                raise ValueError(f"camera.{key} must name every view once, differs at: {odd}")
        if self.intrinsics is not None and set(self.intrinsics.by_view) not in (set(), names):
            odd = ", ".join(sorted(set(self.intrinsics.by_view) ^ names))
            raise ValueError(f"intrinsics.focal_px must name every view once, differs at: {odd}")
        if self.world is not None:
            unknown = sorted(set(self.world.view_errors) - names)
            if unknown:
                raise ValueError(f"world.view_errors names no view: {', '.join(unknown)}")
        if self.world is None and self.is_simulated(with_stage=True):
            raise ValueError("a simulated camera or stage needs a [world] section")
        if self.camera.needs_real_time and self.world is not None and self.world.clock != "real":
            raise ValueError(
                f"the simulated camera {self.camera.kind} runs in real time; "
                'set world.clock = "real"'
            )
        return self

    def is_simulated(self, *, with_stage: bool) -> bool:
        """Whether a part of the rig is simulated and needs the `world`.

        Args:
            with_stage: whether the stage takes part.
        """
        carriers = self.stages.carriers.values()
        moved = (self.stage, *carriers) if with_stage else tuple(carriers)
        return self.camera.is_simulated or any(s is not None and s.is_simulated for s in moved)

    def first_difference(self, other: Self, parts: tuple[str, ...]) -> str | None:
        """Return the first of these parts in which two profiles differ, None where they agree."""
        return next((p for p in parts if getattr(self, p) != getattr(other, p)), None)

    def require_two_views(self, what: str) -> None:
        """Refuse what is worked out from the difference between views.

        Args:
            what: is asked for, as "a sweep".

        Raises:
            ConfigError: there is one view only.
        """
        if len(self.views) == 1:
            raise ConfigError(
                f"profile {self.name}: {what} needs two views or more, it has one",
                advice=f"rig calibrate {self.name} finds its lens; depth takes another [[views]]",
            )

    @property
    def reference(self) -> int:
        """Index of the reference view."""
        return next(
            i for i, view in enumerate(self.views) if view.x_steps == 0.0 and view.y_steps == 0.0
        )
