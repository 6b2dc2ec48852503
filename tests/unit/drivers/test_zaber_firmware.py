"""Zaber devices of other ages: settings that they lack, motors, the binary protocol."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.zaber.binary import read_devices
from rig_drivers.zaber.controller import UNKNOWN_BRAKING_S

from rig.errors import ConfigError, DeviceNotFoundError, StageAlarmError
from rig.profile import FirmwareConfig, ZaberFirmwareConfig
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import (
    FIRMWARE,
    MICROSTEP_MM,
    TIMEOUT_S,
    ZABER,
    simulated_bench,
    zaber_of,
)

OPTIONAL = (
    "deviceid",
    "system.serial",
    "system.axiscount",
    "limit.min",
    "limit.max",
    "limit.home.preset",
    "motion.decelonly",
)


def firmware_with(**changes: object) -> FirmwareConfig:
    return FIRMWARE.model_copy(update={"zaber": ZaberFirmwareConfig.model_validate(changes)})


@pytest.mark.parametrize("lacks", [*((name,) for name in OPTIONAL), OPTIONAL])
def test_a_setting_that_a_firmware_lacks_is_no_end(lacks: tuple[str, ...]) -> None:
    with simulated_bench(ZABER, firmware_with(lacks=lacks)) as bench, bench.stage as stage:
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)
        assert (stage.identity["serial"] == "") is ("system.serial" in lacks)
        assert (stage.identity["device_id"] == "") is ("deviceid" in lacks)


def test_another_refusal_of_a_setting_ends_the_opening() -> None:
    config = ZABER.model_copy(update={"axis_number": 4})
    with (
        simulated_bench(config, firmware_with(lacks=("system.axiscount",))) as bench,
        pytest.raises(StageAlarmError, match="RJ BADAXIS: no such axis"),
    ):
        bench.stage.__enter__()


def test_a_setting_that_a_move_needs_is_still_asked_for() -> None:
    with (
        simulated_bench(ZABER, firmware_with(lacks=("maxspeed",))) as bench,
        pytest.raises(StageAlarmError, match=r"`get maxspeed` was refused, RJ BADCOMMAND"),
    ):
        bench.stage.__enter__()


@pytest.mark.parametrize(
    ("lacks", "pause_s"),
    [
        (("motion.decelonly", "accel"), UNKNOWN_BRAKING_S),
        (("motion.decelonly",), UNKNOWN_BRAKING_S),
        ((), 1.1 * 100.0 / 400.0),
    ],
)
def test_the_time_to_brake_is_long_where_nothing_tells_it(
    lacks: tuple[str, ...], pause_s: float
) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    firmware = firmware_with(lacks=lacks)
    with simulated_bench(ZABER, firmware, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, interrupt)
        start_s = bench.clock.now_s()
        with pytest.raises(KeyboardInterrupt):
            stage.move_to(120.0, TIMEOUT_S)
        assert bench.clock.now_s() - start_s == pytest.approx(0.2 + pause_s, abs=0.15)
        assert not bench.is_moving()


@pytest.mark.parametrize("flag", ["FO", "FD"])
def test_firmware_6_switches_its_motor_on_by_homing(flag: str) -> None:
    firmware = firmware_with(lacks=("driver",))
    with simulated_bench(ZABER, firmware) as bench:
        zaber_of(bench).axis.flags |= {flag, "WR"}
        with bench.stage as stage:
            stage.home()
            assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


def test_a_motor_that_cannot_be_switched_off_is_told() -> None:
    config = ZABER.model_copy(update={"motor_off_at_end": True})
    with simulated_bench(config, firmware_with(lacks=("driver",))) as bench:
        stage = bench.stage.__enter__()
        with pytest.raises(ConfigError, match=r"knows no `driver disable`; .*set it to false"):
            stage.__exit__(None, None, None)


# -- the binary protocol --------------------------------------------------------------------------


def test_a_device_in_the_binary_protocol_is_named_with_its_cure() -> None:
    binary = firmware_with(is_binary=True, addresses=(1, 4))
    with simulated_bench(ZABER, binary) as bench:
        with pytest.raises(DeviceNotFoundError, match="found device 1, 4 in the binary") as caught:
            bench.stage.__enter__()
        assert "at 9600 baud" in caught.value.found
        assert "switch it to ASCII at 115200 baud" in caught.value.advice


def test_who_answers_in_ascii_is_never_asked_in_binary() -> None:
    config = ZABER.model_copy(update={"device_address": 2})
    with simulated_bench(config, before=Scripted) as bench:
        with pytest.raises(DeviceNotFoundError, match="devices 1 answered"):
            bench.stage.__enter__()
        assert b"\x00\x32" not in scripted(bench).sent


@pytest.mark.parametrize(
    ("data", "devices"),
    [
        (bytes((1, 50, 0x81, 0x4E, 0, 0)), (1,)),
        (bytes((3, 255, 64, 0, 0, 0, 1, 50, 0, 0, 0, 0)), (1, 3)),
        (bytes((1, 50, 0, 0, 0, 0, 1)), ()),
        (bytes((1, 49, 0, 0, 0, 0)), ()),
        (bytes((0, 50, 0, 0, 0, 0)), ()),
        (b"", ()),
        (b"Grbl 1", ()),
    ],
)
def test_binary_answers_are_read(data: bytes, devices: tuple[int, ...]) -> None:
    assert tuple(read_devices(data)) == devices


@given(st.binary(max_size=60))
def test_any_bytes_give_numbers_of_devices(data: bytes) -> None:
    assert all(0 < number < 256 for number in read_devices(data))
