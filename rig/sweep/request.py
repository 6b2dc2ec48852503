"""What a sweep is asked to do: the command line's wishes over the profile's defaults."""

from dataclasses import dataclass

from rig.errors import ConfigError
from rig.plan import Stop, even_distances_mm, move_time_s, plan_stops
from rig.profile import (
    CharucoConfig,
    CheckerboardConfig,
    Profile,
    SquaresConfig,
    StageConfig,
    SweepConfig,
)
from rig.sweep.take import SweepTimes


@dataclass(frozen=True, slots=True)
class SweepRequest:
    """Wishes for one sweep; None takes the profile's value."""

    from_mm: float | None = None
    to_mm: float | None = None
    count: int | None = None
    at_mm: tuple[float, ...] = ()
    samples: int | None = None


@dataclass(frozen=True, slots=True)
class SweepSetup:
    """The parts of a profile that a sweep needs, all present."""

    stage: StageConfig
    target: SquaresConfig
    config: SweepConfig


def sweep_setup(profile: Profile) -> SweepSetup:
    """Return the parts of the profile that a sweep needs.

    Raises:
        ConfigError: one of them is missing in the profile, it has one view only, or its target has
            no squares.
    """
    profile.require_two_views("a sweep")
    stage, target, config = profile.stage, profile.target, profile.sweep
    if stage is None or target is None or config is None:
        parts = {"stage": stage, "target": target, "sweep": config}
        missing = ", ".join(f"[{name}]" for name, part in parts.items() if part is None)
        raise ConfigError(
            f"profile {profile.name}: a sweep needs {missing}", advice="add it to the file"
        )
    if not isinstance(target, CheckerboardConfig | CharucoConfig):
        raise ConfigError(
            f"profile {profile.name}: a sweep measures the edges of squares, a target of kind "
            f"{target.kind} has none",
            advice="rig calibrate takes it in the hand; sweep with a checkerboard or a ChArUco "
            "board",
        )
    return SweepSetup(stage, target, config)


def plan_of(profile: Profile, request: SweepRequest) -> tuple[tuple[Stop, ...], int]:
    """Return the stops in their order and the samples per stop.

    Raises:
        ConfigError: the profile lacks a part, or the distances make no plan.
        StageLimitError: a distance lies outside the travel; nothing has moved.
    """
    setup = sweep_setup(profile)
    config = setup.config
    distances_mm = request.at_mm or even_distances_mm(
        config.from_mm if request.from_mm is None else request.from_mm,
        config.to_mm if request.to_mm is None else request.to_mm,
        config.count if request.count is None else request.count,
    )
    stops = plan_stops(
        distances_mm,
        holdout_every=config.holdout_every,
        backward_every=config.backward_every,
        travel_mm=setup.stage.travel_mm,
        stage=f"stage {setup.stage.place}",
    )
    return stops, config.samples if request.samples is None else request.samples


def planned_times(profile: Profile, stops: tuple[Stop, ...], samples: int) -> SweepTimes:
    """Estimate the time of a sweep that begins at its first stop."""
    setup = sweep_setup(profile)
    stage = setup.stage
    moves_s = 0.0
    here_mm = stops[0].distance_mm
    for stop in stops[1:]:
        way_mm = stop.distance_mm - here_mm
        is_straight = way_mm >= stage.approach_mm
        legs_mm = (way_mm,) if is_straight else (way_mm - stage.approach_mm, stage.approach_mm)
        moves_s += sum(
            move_time_s(leg, stage.speed_mm_s, stage.acceleration_mm_s2) for leg in legs_mm
        )
        here_mm = stop.distance_mm
    return SweepTimes(
        moves_s=moves_s,
        settling_s=setup.config.settle_s * len(stops),
        exposures_s=profile.camera.typical_grab_s * samples * len(stops),
    )
