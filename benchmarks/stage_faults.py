"""Sweeps over every serial protocol with one fault each, at random moments: what came of them.

    python -m benchmarks.stage_faults [--moments 50] [--seed 1] [--protocol zaber ...]

The real driver talks to the simulated controller through a wire that fails once; time is virtual.
A sweep opens the stage, homes it, and takes samples at five distances; then the wire is mended and
the sweep is resumed with what it had. Every sample's distance is compared with the truth.
"""

import argparse
import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from rig_sim.wire import Firmware
from rig_sim.wire.faults import Fault, FaultyWire

from rig.devices import Clock
from rig.errors import DeviceLostError, RigError
from rig.plan import Stop, plan_stops
from rig.sweep.take import SweepTimes, run_sweep
from rig.testing.witness import Witness
from tests.support.stages import MARLIN, STAGE, ZABER, Bench, simulated_bench
from tests.support.wire_faults import IN_MOTION, MAKERS, NO_FAULT

STAGES = {config.kind: config for config in (STAGE, ZABER, MARLIN)}
DISTANCES_MM = (115.0, 130.0, 160.0, 185.0, 199.0)
SAMPLES = 2
MOVE_TIMEOUT_S = 10.0
LONGEST_S = 90.0
"""Bound of a sweep with a fault: opening, homing and moves, each with all its attempts."""
RIGHT_MM = 0.004
"""Largest difference between the distance told and the truth; a microstep is 0.0025 mm."""


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
    """Sweeps that took longer than `LONGEST_S`,"""
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


class WatchedWire(FaultyWire):
    """A wire that notes how much had passed whenever the carriage moved."""

    def __init__(self, firmware: Firmware, fault: Fault) -> None:
        super().__init__(firmware, fault)
        self.bench: Bench | None = None
        self.in_motion: list[int] = []

    def receive(self, data: bytes) -> None:
        """See `Firmware.receive`."""
        if self.bench is not None and self.bench.is_moving():
            self.in_motion.append(self.passed_bytes)
        super().receive(data)


@dataclass(slots=True)
class Sweep:
    """One sweep over one bench, as far as it has come."""

    bench: Bench
    stops: Sequence[Stop]
    done: dict[int, set[int]] = field(default_factory=dict[int, set[int]])
    worst_mm: float = 0.0

    def run(self) -> None:
        """Open, home, take what is missing."""
        clock: Clock = self.bench.clock
        camera = Witness(clock, self.bench.true_mm)
        with self.bench.stage as stage:
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
                grab_timeout_s=1.0,
                times=SweepTimes(),
                done=done,
            ):
                self.done.setdefault(new.stop.index, set()).add(new.sample)
                self.worst_mm = max(self.worst_mm, abs(new.reached_mm - camera.seen_mm[-1]))

    @property
    def is_finished(self) -> bool:
        """Whether every sample has been taken."""
        return sum(map(len, self.done.values())) == SAMPLES * len(self.stops)


def moments_of(protocol: str, *, in_motion: bool) -> Sequence[int]:
    """Return the numbers of bytes after which something can happen in a sweep without a fault."""
    wires: list[WatchedWire] = []

    def watch(firmware: Firmware) -> FaultyWire:
        wires.append(WatchedWire(firmware, NO_FAULT))
        return wires[0]

    with simulated_bench(STAGES[protocol], before=watch) as bench:
        wires[0].bench = bench
        Sweep(bench, stops_of(protocol)).run()
    return wires[0].in_motion if in_motion else range(wires[0].passed_bytes)


def stops_of(protocol: str) -> Sequence[Stop]:
    """Return the stops of the sweep."""
    travel_mm = STAGES[protocol].travel_mm
    return plan_stops(
        DISTANCES_MM, holdout_every=0, backward_every=3, travel_mm=travel_mm, stage="stage"
    )


def sweep_with(protocol: str, fault: Fault, tally: Tally) -> None:
    """Sweep with a fault, then resume without one, and note what came of it."""
    wires: list[FaultyWire] = []

    def spoil(firmware: Firmware) -> FaultyWire:
        wires.append(FaultyWire(firmware, fault))
        return wires[0]

    with simulated_bench(STAGES[protocol], before=spoil) as bench:
        wire = wires[0]
        sweep = Sweep(bench, stops_of(protocol))
        begun_s = bench.clock.now_s()
        error: RigError | None = None
        try:
            sweep.run()
        except RigError as told:
            error = told
        took_s = bench.clock.now_s() - begun_s
        tally.sweeps += 1
        tally.struck += wire.has_struck
        tally.longest_s = max(tally.longest_s, took_s)
        tally.late += took_s > LONGEST_S
        tally.moving += bench.is_moving() and not isinstance(error, DeviceLostError)
        if error is None:
            tally.finished += sweep.is_finished
        else:
            tally.told[type(error).__name__] += 1
            _resume(sweep, wire, tally)
        tally.wrong += sweep.worst_mm > RIGHT_MM


def _resume(sweep: Sweep, wire: FaultyWire, tally: Tally) -> None:
    """Go on with a good wire, as somebody does who has plugged the cable in again."""
    wire.mend()
    sweep.bench.clock.sleep_s(5.0)
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
        for kind in MAKERS:
            tally = campaign(protocol, kind, moments=options.moments, seed=options.seed)
            print(row(protocol, kind, tally), flush=True)
            is_good = is_good and tally.is_good
    raise SystemExit(0 if is_good else 1)


if __name__ == "__main__":
    main()
