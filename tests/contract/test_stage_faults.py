"""Whatever happens on the wire, no stage ever reports a place where the board is not.

With every protocol, every fault of `rig_sim.wire.faults` strikes at seeded moments of one session:
open, home, move there and back. Then one of two things must hold: all went well and the board
truly is where it was reported, or one of our errors was told, in bounded time, and the motor stands
unless the error says that it could not be stopped.
"""

import random
from dataclasses import dataclass
from functools import cache

import pytest
from rig_sim.wire.faults import Fault, FaultyWire

from rig.errors import DeviceLostError, RigError
from tests.support.stages import MARLIN, STAGE, ZABER, simulated_bench
from tests.support.wire_faults import ENDS_THE_DIALOGUE, MAKERS, NO_FAULT

PLACES_MM = (150.0, 121.0, 199.0)
MOVE_TIMEOUT_S = 10.0
LONGEST_S = 90.0
"""Opening, homing, moves and stopping, each with all its attempts, take no longer together."""
STAGES = {config.kind: config for config in (STAGE, ZABER, MARLIN)}
MICROSTEP_MM = 0.004


@dataclass(frozen=True, slots=True)
class Session:
    """What came of one session with a fault."""

    wire: FaultyWire
    error: RigError | None
    took_s: float


def run_session(protocol: str, fault: Fault) -> Session:
    wires: list[FaultyWire] = []

    def before(firmware: object) -> FaultyWire:
        wires.append(FaultyWire(firmware, fault))  # pyright: ignore[reportArgumentType]
        return wires[0]

    told: RigError | None = None
    with simulated_bench(STAGES[protocol], before=before) as bench:
        start_s = bench.clock.now_s()
        try:
            with bench.stage as stage:
                stage.home()
                for wanted_mm in PLACES_MM:
                    reached_mm = stage.move_to(wanted_mm, MOVE_TIMEOUT_S)
                    assert reached_mm == pytest.approx(wanted_mm, abs=0.02)
                    assert bench.true_mm() == pytest.approx(wanted_mm, abs=MICROSTEP_MM), fault
        except RigError as error:
            told = error
        took_s = bench.clock.now_s() - start_s
        assert took_s < LONGEST_S, fault
        assert isinstance(told, DeviceLostError) or not bench.is_moving(), fault
    return Session(wires[0], told, took_s)


@cache
def bytes_of_a_session(protocol: str) -> int:
    """How many bytes pass in a session without a fault."""
    return run_session(protocol, NO_FAULT).wire.passed_bytes


@pytest.mark.parametrize("protocol", STAGES)
def test_without_a_fault_all_is_well(protocol: str) -> None:
    session = run_session(protocol, NO_FAULT)
    assert session.error is None
    assert not session.wire.has_struck


def strike(protocol: str, kind: str, count: int, seed: int) -> list[Session]:
    rng = random.Random(f"{protocol} {kind} {seed}")  # noqa: S311
    latest = bytes_of_a_session(protocol)
    return [run_session(protocol, MAKERS[kind](rng.randrange(latest), rng)) for _ in range(count)]


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("protocol", STAGES)
def test_a_fault_never_gives_a_wrong_place(protocol: str, kind: str) -> None:
    sessions = strike(protocol, kind, 2, seed=1)
    assert any(session.wire.has_struck for session in sessions)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ENDS_THE_DIALOGUE)
@pytest.mark.parametrize("protocol", STAGES)
def test_what_ends_the_dialogue_is_always_told(protocol: str, kind: str) -> None:
    for session in strike(protocol, kind, 3, seed=2):
        assert session.error is not None or not session.wire.has_struck


@pytest.mark.slow
@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("protocol", STAGES)
def test_a_fault_never_gives_a_wrong_place_at_many_moments(protocol: str, kind: str) -> None:
    strike(protocol, kind, 15, seed=3)
