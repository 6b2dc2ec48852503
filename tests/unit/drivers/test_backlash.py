"""Backlash of the mechanics, which every stage takes out by coming from one side."""

import pytest

from rig.profile import StageConfig
from tests.support.stages import (
    MARLIN,
    MICROSTEP_MM,
    STAGE,
    TIMEOUT_S,
    ZABER,
    simulated_bench,
)


@pytest.mark.parametrize("config", [STAGE, ZABER, MARLIN], ids=lambda config: config.kind)
@pytest.mark.parametrize("places_mm", [(120.0, 150.0, 190.0), (190.0, 150.0, 120.0, 119.0)])
def test_with_an_approach_backlash_leaves_no_error(
    config: StageConfig, places_mm: tuple[float, ...]
) -> None:
    with simulated_bench(config) as bench, bench.stage as stage:
        stage.home()
        for wanted_mm in places_mm:
            assert stage.move_to(wanted_mm, TIMEOUT_S) == pytest.approx(wanted_mm, abs=MICROSTEP_MM)
            assert bench.true_mm() == pytest.approx(wanted_mm, abs=MICROSTEP_MM)
