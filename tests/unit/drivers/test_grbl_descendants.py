"""grblHAL and FluidNC: what the GRBL stage makes of its descendants."""

import pytest

from rig.errors import (
    ConfigError,
    StageAlarmError,
)
from rig.profile import FirmwareConfig
from tests.support.scripted_wire import Scripted, scripted
from tests.support.stages import FIRMWARE, TIMEOUT_S, simulated_bench


@pytest.mark.parametrize(
    ("dialect", "firmware", "version"),
    [("grblhal", "grblHAL", "1.1f"), ("fluidnc", "FluidNC", "3.7")],
)
def test_descendants_of_grbl_are_known_by_name(dialect: str, firmware: str, version: str) -> None:
    with simulated_bench(firmware=dialect_of(dialect)) as bench, bench.stage as stage:
        assert stage.identity["firmware"] == firmware
        assert stage.identity["version"] == version


def dialect_of(dialect: str, **changes: object) -> FirmwareConfig:
    return FIRMWARE.model_copy(update={"grbl_dialect": dialect, **changes})


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"soft_limits": False}, r"FluidNC has /axes/x/soft_limits false; set it to true"),
        ({"homing": False}, r"FluidNC has no /axes/x/homing/mpos_mm"),
    ],
)
def test_a_fluidnc_that_is_not_safe_is_refused(changes: dict[str, object], expected: str) -> None:
    with (
        simulated_bench(firmware=dialect_of("fluidnc", **changes)) as bench,
        pytest.raises(ConfigError, match=expected),
    ):
        bench.stage.__enter__()


def test_an_alarm_is_told_in_the_words_of_its_dialect() -> None:
    firmware = dialect_of("grblhal")
    with simulated_bench(firmware=firmware, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = lambda data: data + b"ALARM:17\r\n"
        with pytest.raises(StageAlarmError, match="motor driver reports a fault"):
            stage.move_to(150.0, TIMEOUT_S)
        scripted(bench).on_transmit = lambda data: data
