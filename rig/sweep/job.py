"""A sweep that can begin: a new one, or an interrupted one that goes on."""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors import ConfigError, StoreError
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
    is_taken: bool = False
    """Whether every sample is stored, so that only the curve is missing and no device is needed."""
    note: str = ""
    """Free text of the user, for a new one."""
    tags: tuple[str, ...] = ()
    """Words to find it again by, for a new one."""

    @property
    def go_on(self) -> str:
        """The command that goes on with it."""
        return f"rig sweep {self.run.profile.name} --resume {self.sweep_id}"

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


@contextmanager
def owned_to_resume(store: "Store", profile: Profile, sweep_id: int | None) -> Generator[SweepJob]:
    """Become the owner of an interrupted sweep, before any device is opened.

    Args:
        store: where it is.
        profile: the rig.
        sweep_id: its number; None for the newest of the rig.

    Yields:
        The sweep as it is then; nothing in it was changed.

    Raises:
        ConfigError: the sweep was taken with another arrangement of the rig.
        OwnedError: another program works on it; names that one.
        StoreError: there is no such sweep, or it is concluded.
    """
    number = resumed_sweep(store, profile, sweep_id).sweep_id
    if number is None:
        raise AssertionError  # a resumed sweep has one
    with store.owned_sweep(number, f"asked to resume sweep {number}"):
        # Only now nobody else adds to it.
        yield resumed_sweep(store, profile, number)


def resumed_sweep(store: "Store", profile: Profile, sweep_id: int | None) -> SweepJob:
    """Look up an interrupted sweep where it stopped, with the calibration that it began with.

    Raises:
        ConfigError: the sweep was taken with another arrangement of the rig.
        StoreError: there is no such sweep, or it is concluded.
    """
    sweep = store.last_resumable_sweep(profile.name) if sweep_id is None else store.sweep(sweep_id)
    if sweep.state == "concluded":
        raise StoreError(
            f"asked to resume sweep {sweep.id}, it is concluded",
            advice=f"begin a new one; rig report {sweep.id} writes its report again",
        )
    before = stored_profile(sweep)
    what = profile.first_difference(before, ("name", "views", "pitch_mm", "target"))
    if what is not None:
        raise ConfigError(
            f"asked to resume sweep {sweep.id} of rig {before.name} with profile {profile.name}: "
            f"{what} differs from what the sweep began with",
            advice="use the same profile, or begin a new sweep",
        )
    run = run_with(store, profile, sweep.calibration_id)
    stored = {sample.key for sample in store.samples(sweep.id)}
    planned = {
        (stop.index, number) for stop in sweep.stops for number in range(sweep.samples_per_stop)
    }
    return SweepJob(run, sweep.stops, sweep.samples_per_stop, sweep.id, is_taken=planned <= stored)
