"""Every stage of this repository keeps the suite of `rig.testing`.

The real stage takes part where RIG_GRBL_PORT names its port; RIG_GRBL_TRAVEL_MM ("near,far") and
RIG_GRBL_ZERO_MM describe it. It homes and moves: clear its way.
"""

import os
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager

import pytest
from rig_drivers.grbl.controller import grbl_stage
from rig_sim.rehearsal import RehearsedStage

from rig.devices import SystemClock
from rig.profile import GrblStageConfig, MarlinFirmwareConfig, ZaberFirmwareConfig
from rig.testing import StageCase
from rig.testing.test_stage import *  # noqa: F403 - the suite itself
from tests.support.people import manual_bench
from tests.support.programs import command_bench
from tests.support.stages import CARRIAGE, FIRMWARE, MARLIN, STAGE, ZABER, ZERO_MM, simulated_bench


@contextmanager
def grbl_over_simulated_wire() -> Generator[StageCase]:
    with simulated_bench() as bench:
        yield StageCase(bench.stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def grblhal_over_simulated_wire() -> Generator[StageCase]:
    one_switch = {"grbl_dialect": "grblhal", "homes_z_first": True}
    with simulated_bench(firmware=FIRMWARE.model_copy(update=one_switch)) as bench:
        yield StageCase(bench.stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def fluidnc_over_simulated_wire() -> Generator[StageCase]:
    config = STAGE.model_copy(update={"distance_at_machine_zero_mm": ZERO_MM - 2.0})
    with_wifi = {"grbl_dialect": "fluidnc", "homes_z_first": True, "connecting_s": 8.0}
    firmware = FIRMWARE.model_copy(update=with_wifi)
    with simulated_bench(config, firmware) as bench:
        yield StageCase(bench.stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def zaber_over_simulated_wire() -> Generator[StageCase]:
    with simulated_bench(ZABER) as bench:
        yield StageCase(bench.stage, bench.clock, ZABER.tolerance_mm, is_reset_by_opening=False)


@contextmanager
def zaber_in_a_chain() -> Generator[StageCase]:
    old = ("system.serial", "limit.home.preset", "motion.decelonly", "driver")
    chain = ZaberFirmwareConfig(addresses=(2, 1, 7), address=7, axes=3, axis=2, lacks=old)
    config = ZABER.model_copy(update={"device_address": 7, "axis_number": 2})
    with simulated_bench(config, FIRMWARE.model_copy(update={"zaber": chain})) as bench:
        yield StageCase(bench.stage, bench.clock, ZABER.tolerance_mm, is_reset_by_opening=False)


@contextmanager
def marlin_over_simulated_wire() -> Generator[StageCase]:
    with simulated_bench(MARLIN) as bench:
        yield StageCase(bench.stage, bench.clock, MARLIN.tolerance_mm, brakes=False)


@contextmanager
def marlin_without_emergency_parser() -> Generator[StageCase]:
    plain = MarlinFirmwareConfig(
        emergency_parser=False, advanced_ok=True, answers_late=True, axes=1
    )
    with simulated_bench(MARLIN, FIRMWARE.model_copy(update={"marlin": plain})) as bench:
        yield StageCase(bench.stage, bench.clock, MARLIN.tolerance_mm, brakes=False)


@contextmanager
def a_rehearsed_one() -> Generator[StageCase]:
    with simulated_bench() as bench:
        stage = RehearsedStage(bench.stage, CARRIAGE)
        yield StageCase(stage, bench.clock, STAGE.tolerance_mm)


@contextmanager
def a_person() -> Generator[StageCase]:
    # The way to the far end takes longer than the patience, but not than the suite's own timeout.
    with manual_bench(patience_s=5.0) as (stage, person, clock):
        person.slow_to, person.slowly_s = "900.0", 8.0
        yield StageCase(stage, clock, 0.0, brakes=False)


@contextmanager
def a_program() -> Generator[StageCase]:
    with command_bench() as (stage, _, clock):
        yield StageCase(stage, clock, 0.05)


@contextmanager
def real_grbl() -> Generator[StageCase]:
    port = os.environ.get("RIG_GRBL_PORT")
    if port is None:
        pytest.skip("RIG_GRBL_PORT names no real stage")
    near, far = os.environ["RIG_GRBL_TRAVEL_MM"].split(",")
    config = GrblStageConfig(
        kind="grbl",
        port=port,
        travel_mm=(float(near), float(far)),
        distance_at_machine_zero_mm=float(os.environ["RIG_GRBL_ZERO_MM"]),
        speed_mm_s=10.0,
    )
    clock = SystemClock()
    yield StageCase(grbl_stage(config, clock), clock, config.tolerance_mm)


Maker = Callable[[], AbstractContextManager[StageCase]]


@pytest.fixture(
    params=[
        grbl_over_simulated_wire,
        grblhal_over_simulated_wire,
        fluidnc_over_simulated_wire,
        zaber_over_simulated_wire,
        zaber_in_a_chain,
        marlin_over_simulated_wire,
        marlin_without_emergency_parser,
        a_rehearsed_one,
        a_person,
        a_program,
        real_grbl,
    ]
)
def stage_case(request: pytest.FixtureRequest) -> Iterator[StageCase]:
    make: Maker = request.param
    with make() as made:
        yield made
