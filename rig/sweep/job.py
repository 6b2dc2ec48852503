"""A sweep that can begin: a new one, or an interrupted one that goes on."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors import ConfigError
from rig.plan import Stop
from rig.profile import Profile
from rig.stored import Run, open_run, run_with, stored_profile
from rig.sweep.request import SweepRequest, plan_of

if TYPE_CHECKING:
    from rig.database import Store


@dataclass(frozen=True, slots=True)
class SweepJob:
    """A sweep that can begin."""

    run: Run
    """The rig; it has no curve yet."""
    stops: tuple[Stop, ...]
    samples: int
    sweep_id: int | None = None
    """Of the interrupted sweep that goes on."""

    @property
    def total(self) -> int:
        """Samples of the whole sweep."""
        return len(self.stops) * self.samples


def new_sweep(
    store: "Store", profile: Profile, request: SweepRequest, calibration: str | None = None
) -> SweepJob:
    """Plan a sweep from its beginning.

    Args:
        store: where calibrations are.
        profile: the rig.
        request: the wishes of the command line.
        calibration: number of the calibration to use, `none`, or None for the newest of the rig.

    Raises:
        ConfigError: the profile lacks a part, the distances make no plan, the calibration is of
            another rig, or `slopes.range_mm` is given and no calibration tells which slopes it is.
        StageLimitError: a distance lies outside the travel; nothing has moved.
    """
    stops, samples = plan_of(profile, request)
    run = open_run(store, profile, calibration, "none")
    run.require_range()
    return SweepJob(run, stops, samples)


def resumed_sweep(store: "Store", profile: Profile, sweep_id: int | None) -> SweepJob:
    """Take up an interrupted sweep where it stopped, with the calibration that it began with.

    Raises:
        ConfigError: the sweep was taken with another arrangement of the rig.
        StoreError: there is no such sweep, or it is finished.
    """
    sweep = store.last_resumable_sweep(profile.name) if sweep_id is None else store.sweep(sweep_id)
    before = stored_profile(sweep)
    what = profile.first_difference(before, ("name", "views", "pitch_mm", "target"))
    if what is not None:
        raise ConfigError(
            f"asked to resume sweep {sweep.id} of rig {before.name} with profile {profile.name}: "
            f"{what} differs from what the sweep began with",
            advice="use the same profile, or begin a new sweep",
        )
    run = run_with(store, profile, sweep.calibration_id)
    store.reopen_sweep(sweep.id)
    return SweepJob(run, sweep.stops, sweep.samples_per_stop, sweep.id)
