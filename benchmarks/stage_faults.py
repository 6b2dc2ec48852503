"""Sweeps over every serial protocol with one fault each, at random moments: what came of them.

    python -m benchmarks.stage_faults [--moments 50] [--seed 1] [--protocol zaber ...]

The real driver talks to the simulated controller through a wire that fails once; time is virtual.
A program and a person have no wire: see `benchmarks.stage_fault_answers`. Of `two grbl` the second
one carries the camera from view to view, and its wire fails.
A sweep opens the stage, homes it, and takes samples at five distances; then the wire is mended and
the sweep is resumed with what it had. Every sample's distance is compared with the truth.
"""

import argparse
import random
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial

from rig_sim.wire.faults import Fault

from benchmarks.stage_fault_answers import COMMAND, MANUAL, READING_MM, command_bed, manual_bed
from benchmarks.stage_fault_beds import Bed, serial_bed, two_stages_bed
from rig.errors import DeviceLostError, RigError, StageAlarmError
from rig.plan import Stop, plan_stops
from rig.sweep.take import SweepTimes, run_sweep
from rig.testing.witness import Witness
from tests.support.stages import MARLIN, STAGE, ZABER
from tests.support.wire_faults import IN_MOTION, MAKERS, NO_FAULT


@dataclass(frozen=True, slots=True)
class Subject:
    """One kind of stage in the campaign."""

    bed: Callable[[Fault], AbstractContextManager[Bed]]
    travel_mm: tuple[float, float] = STAGE.travel_mm
    right_mm: float = 0.004
    """Largest difference between the distance told and the truth; a microstep is 0.0025 mm."""
    longest_s: float = 90.0
    """Bound of a sweep with a fault: opening, homing and moves, each with all its attempts."""
    faults: tuple[str, ...] = tuple(MAKERS)


STAGES = {
    **{config.kind: Subject(partial(serial_bed, config)) for config in (STAGE, ZABER, MARLIN)},
    # The camera's stage makes some seventy moves, one alone makes eight.
    "two grbl": Subject(partial(two_stages_bed, STAGE), longest_s=600.0),
    "command": Subject(partial(command_bed, COMMAND), right_mm=COMMAND.tolerance_mm),
    # A digit that is typed wrongly is seen where it leads beyond the tolerance.
    "manual": Subject(
        partial(manual_bed, MANUAL),
        right_mm=MANUAL.tolerance_mm + READING_MM,
        longest_s=MANUAL.patience_s + 90.0,
        faults=("drop", "duplicate", "garble", "delay", "silence", "hang up"),
    ),
}
DISTANCES_MM = (115.0, 130.0, 160.0, 185.0, 199.0)
SAMPLES = 2
MOVE_TIMEOUT_S = 10.0
GRAB_TIMEOUT_S = 60.0


@dataclass(slots=True)
class Tally:
    """What came of the sweeps with one kind of fault."""

    sweeps: int = 0
    struck: int = 0
    finished: int = 0
    """Sweeps that went on to their end, with every distance right."""
    told: Counter[str] = field(default_factory=Counter[str])
    """Sweeps that ended with an error, by its class."""
    late: int = 0
    """Sweeps that took longer than they may,"""
    wrong: int = 0
    """that took a wrong distance as right,"""
    moving: int = 0
    """or whose end left the stage moving without saying so."""
    not_resumed: int = 0
    """Resumed sweeps that did not reach their end."""
    longest_s: float = 0.0

    @property
    def is_good(self) -> bool:
        """Whether nothing happened that must not."""
        return not (self.late or self.wrong or self.moving or self.not_resumed)


@dataclass(slots=True)
class Sweep:
    """One sweep over one bench, as far as it has come."""

    bed: Bed
    stops: Sequence[Stop]
    done: dict[int, set[int]] = field(default_factory=dict[int, set[int]])
    worst_mm: float = 0.0

    def run(self) -> None:
        """Open, home, take what is missing."""
        clock = self.bed.clock
        witness = Witness(clock, self.bed.true_mm)
        with self.bed.stage as stage, self.bed.carry(witness) as camera:
            stage.home()
            done = {stop: frozenset(numbers) for stop, numbers in self.done.items()}
            for new in run_sweep(
                self.stops,
                stage=stage,
                camera=camera,
                clock=clock,
                samples=SAMPLES,
                settle_s=0.4,
                move_timeout_s=MOVE_TIMEOUT_S,
                grab_timeout_s=GRAB_TIMEOUT_S,
                times=SweepTimes(),
                done=done,
            ):
                self.done.setdefault(new.stop.index, set()).add(new.sample)
                self.worst_mm = max(self.worst_mm, abs(new.reached_mm - witness.seen_mm[-1]))

    @property
    def is_finished(self) -> bool:
        """Whether every sample has been taken."""
        return sum(map(len, self.done.values())) == SAMPLES * len(self.stops)


def moments_of(protocol: str, *, in_motion: bool) -> Sequence[int]:
    """Return the numbers of bytes after which something can happen in a sweep without a fault."""
    with STAGES[protocol].bed(NO_FAULT) as bed:
        Sweep(bed, stops_of(protocol)).run()
        return list(bed.striker.in_motion) if in_motion else range(bed.striker.passed)


def stops_of(protocol: str) -> Sequence[Stop]:
    """Return the stops of the sweep."""
    travel_mm = STAGES[protocol].travel_mm
    return plan_stops(
        DISTANCES_MM, holdout_every=0, backward_every=3, travel_mm=travel_mm, stage="stage"
    )


def sweep_with(protocol: str, fault: Fault, tally: Tally) -> None:
    """Sweep with a fault, then resume without one, and note what came of it."""
    subject = STAGES[protocol]
    with subject.bed(fault) as bed:
        sweep = Sweep(bed, stops_of(protocol))
        begun_s = bed.clock.now_s()
        error: RigError | None = None
        try:
            sweep.run()
        except RigError as told:
            error = told
        took_s = bed.clock.now_s() - begun_s
        tally.sweeps += 1
        tally.struck += bed.striker.has_struck
        tally.longest_s = max(tally.longest_s, took_s)
        tally.late += took_s > subject.longest_s
        tally.moving += bed.is_moving() and not _says_so(error)
        if error is None:
            tally.finished += sweep.is_finished
        else:
            tally.told[type(error).__name__] += 1
            _resume(sweep, tally)
        tally.wrong += max(sweep.worst_mm, bed.worst_elsewhere_mm()) > subject.right_mm


def _says_so(error: RigError | None) -> bool:
    """Whether an error tells that a stage may still be moving."""
    is_told = isinstance(error, StageAlarmError) and error.code == "not stopped"
    return is_told or isinstance(error, DeviceLostError)


def _resume(sweep: Sweep, tally: Tally) -> None:
    """Go on with a good wire, as somebody does who has plugged the cable in again."""
    sweep.bed.striker.mend()
    sweep.bed.clock.sleep_s(5.0)
    try:
        sweep.run()
    except RigError:
        tally.not_resumed += 1
    else:
        tally.not_resumed += not sweep.is_finished


def campaign(protocol: str, kind: str, *, moments: int, seed: int) -> Tally:
    """Return what came of `moments` sweeps with one kind of fault."""
    rng = random.Random(f"{protocol} {kind} {seed}")  # noqa: S311
    possible = moments_of(protocol, in_motion=kind in IN_MOTION)
    tally = Tally()
    for _ in range(moments):
        sweep_with(protocol, MAKERS[kind](rng.choice(possible), rng), tally)
    return tally


def row(protocol: str, kind: str, tally: Tally) -> str:
    """Return a line of the table."""
    told = ", ".join(f"{name} {count}" for name, count in sorted(tally.told.items())) or "-"
    resumed = sum(tally.told.values()) - tally.not_resumed
    where = f"{kind} in motion" if kind in IN_MOTION else kind
    return (
        f"| {protocol} | {where} | {tally.sweeps} | {tally.struck} | {tally.finished} | {told} | "
        f"{resumed} | {tally.late} | {tally.wrong} | {tally.moving} | {tally.longest_s:.0f} |"
    )


def main() -> None:
    """Print the table; ends with 1 if something happened that must not."""
    parser = argparse.ArgumentParser(description="Faults of the wire during sweeps.")
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--protocol", nargs="*", default=list(STAGES), choices=list(STAGES))
    options = parser.parse_args()
    print(
        "| protocol | fault | sweeps | struck | finished, all right | told as | resumed to the end "
        "| too late | wrong distance | left moving untold | longest, s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    is_good = True
    for protocol in options.protocol:
        for kind in STAGES[protocol].faults:
            tally = campaign(protocol, kind, moments=options.moments, seed=options.seed)
            print(row(protocol, kind, tally), flush=True)
            is_good = is_good and tally.is_good
    raise SystemExit(0 if is_good else 1)


if __name__ == "__main__":
    main()
