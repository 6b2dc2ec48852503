"""The Zaber stage against a simulated chain: truth, opening and homing."""

from collections.abc import Callable

import pytest
from rig_drivers.zaber.controller import ZaberController
from rig_drivers.zaber.message import checksum
from rig_drivers.zaber.words import HARMLESS, INTERFERENCE, UNHOMED

from rig.errors import (
    ConfigError,
    DeviceNotFoundError,
    StageAlarmError,
    StageTimeoutError,
)
from rig.profile import ZaberFirmwareConfig
from tests.support.scripted_wire import Scripted, scripted
from tests.support.stages import (
    CARRIAGE,
    FIRMWARE,
    MICROSTEP_MM,
    TIMEOUT_S,
    URL,
    ZABER,
    simulated_bench,
    zaber_of,
)


def firmware_with(**changes: object):
    return FIRMWARE.model_copy(update={"zaber": ZaberFirmwareConfig.model_validate(changes)})


def test_it_knows_the_device() -> None:
    with simulated_bench(ZABER) as bench, bench.stage as stage:
        assert stage.identity == {
            "kind": "zaber",
            "port": URL,
            "version": "7.33",
            "device_id": "50081",
            "serial": "91001",
            "address": "1",
            "axis": "1",
        }


def test_every_command_carries_number_and_checksum() -> None:
    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        lines = scripted(bench).sent.decode().splitlines()
        for line in lines:
            body, _, check = line[1:].rpartition(":")
            assert (sum(body.encode()) + int(check, 16)) % 256 == 0
            assert body.split()[2].isdigit()
        assert any("move abs 24000 52429" in line for line in lines), "80 mm/s, native units"


# -- flags ----------------------------------------------------------------------------------------


def opens_homed(flags: set[str]) -> bool:
    """Whether a stage that was homed before is so still, after it was opened under flags."""
    with simulated_bench(ZABER) as bench:
        with bench.stage as stage:
            stage.home()
        zaber_of(bench).axis.flags = set(flags)
        with bench.stage as stage:
            zaber_of(bench).axis.flags = set()
            try:
                _ = stage.position_mm
            except StageAlarmError:
                return False
            return True


def test_harmless_flags_keep_the_reference_one_by_one_and_all_together() -> None:
    every = HARMLESS | INTERFERENCE
    for flags in ({flag} for flag in every):
        assert opens_homed(flags), flags
    assert opens_homed(set())
    assert opens_homed(set(every))
    assert not opens_homed({*every, "WL"})


@pytest.mark.parametrize("flag", sorted(UNHOMED | {"FS", "FQ", "WS"}))
def test_a_flag_that_costs_the_position_costs_the_reference(flag: str) -> None:
    assert not opens_homed({flag})


def test_all_interferences_together_are_told_and_cost_nothing() -> None:
    with simulated_bench(ZABER) as bench, bench.stage as stage:
        stage.home()
        before_mm = stage.move_to(150.0, TIMEOUT_S)
        zaber_of(bench).axis.flags = set(HARMLESS | INTERFERENCE)
        with pytest.raises(StageAlarmError) as caught:
            _ = stage.position_mm
        assert caught.value.code == "NC"
        zaber_of(bench).axis.flags = set()
        assert stage.position_mm == before_mm


def test_the_most_urgent_flag_is_told() -> None:
    with simulated_bench(ZABER) as bench, bench.stage as stage:
        stage.home()
        for flags, told in (({"WS", "FS"}, "FS"), ({"NI", "WM"}, "WM"), ({"FS", "WL"}, "FS")):
            zaber_of(bench).axis.flags = set(flags)
            with pytest.raises(StageAlarmError) as caught:
                stage.move_to(150.0, TIMEOUT_S)
            assert caught.value.code == told
            stage.home()


def test_a_wrong_list_of_flags_is_told() -> None:
    def with_count(count: str) -> Callable[[bytes], bytes]:
        def changed(data: bytes) -> bytes:
            text = data.decode().strip()
            if not text.endswith(f" 00:{checksum(text[1:-3])}"):
                return data
            body = f"{text[1:-5]}{count}"
            return f"@{body}:{checksum(body)}\r\n".encode()

        return changed

    for count in ("02", "x0"):
        with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
            stage.home()
            scripted(bench).on_transmit = with_count(count)
            with pytest.raises(StageAlarmError, match=f"asked for the flags, found '{count}'"):
                _ = stage.position_mm


# -- speed and braking ----------------------------------------------------------------------------


def test_the_time_to_brake_is_that_of_the_devices_own_settings() -> None:
    with simulated_bench(ZABER) as bench, bench.stage as stage:
        controller = stage._controller
        assert isinstance(controller, ZaberController)
        # v / a of a move at full speed, and a tenth more.
        expected_s = 1.1 * FIRMWARE.max_rate_mm_s / FIRMWARE.acceleration_mm_s2
        assert controller._braking_s == pytest.approx(expected_s, rel=0.01)


@pytest.mark.parametrize(("version", "with_move"), [("7.25", True), ("7.24", False)])
def test_the_speed_goes_with_the_move_from_firmware_7_25_on(version: str, with_move: bool) -> None:
    firmware = firmware_with(version=version).model_copy(update={"max_rate_mm_s": 80.0})
    with simulated_bench(ZABER, firmware, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        assert (b"move abs 24000 52429" in scripted(bench).sent) is with_move


# -- opening --------------------------------------------------------------------------------------


def test_a_wrong_address_names_who_is_there() -> None:
    chain = firmware_with(addresses=(1, 3), address=3)
    config = ZABER.model_copy(update={"device_address": 2})
    with (
        simulated_bench(config, chain) as bench,
        pytest.raises(DeviceNotFoundError, match="device 2, devices 1, 3 answered"),
    ):
        bench.stage.__enter__()


def test_silence_is_told() -> None:
    with (
        simulated_bench(ZABER, before=Scripted) as bench,
        pytest.raises(DeviceNotFoundError, match="device 1, nothing answered"),
    ):
        scripted(bench).on_transmit = lambda _: b""
        bench.stage.__enter__()


def test_answers_without_checksums_are_refused_unless_the_profile_knows() -> None:
    bare = firmware_with(checksum=False)
    with (
        simulated_bench(ZABER, bare) as bench,
        pytest.raises(ConfigError, match=r"send `/1 set comm.checksum 1`"),
    ):
        bench.stage.__enter__()
    config = ZABER.model_copy(update={"replies_with_checksum": False})
    with simulated_bench(config, bare) as bench, bench.stage as stage:
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"travel_mm": (85.0, 200.0)}, r"needs 83\.0\.\.200\.0 mm.*limit\.max allows 90\.0"),
        ({"travel_mm": (110.0, 211.0)}, r"needs 108\.0\.\.211\.0 mm"),
        ({"speed_mm_s": 101.0}, r"speed_mm_s is 101\.0, the controller's maxspeed allows 100\.0"),
        ({"axis_number": 4}, r"axis_number is 4, device 1 has 1 axes"),
    ],
)
def test_a_profile_that_the_device_cannot_keep_is_refused(
    changes: dict[str, object], expected: str
) -> None:
    with (
        simulated_bench(ZABER.model_copy(update=changes)) as bench,
        pytest.raises(ConfigError, match=expected),
    ):
        bench.stage.__enter__()


def test_old_firmware_must_have_the_speed_set() -> None:
    old = firmware_with(version="6.28")
    with (
        simulated_bench(ZABER, old) as bench,
        pytest.raises(ConfigError, match=r"moves at 100\.0 mm/s.*`/1 1 set maxspeed 52429`"),
    ):
        bench.stage.__enter__()
    exact = old.model_copy(update={"max_rate_mm_s": 80.0})
    with simulated_bench(ZABER, exact) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)


def test_a_reference_survives_opening_but_not_a_loss_of_power() -> None:
    with simulated_bench(ZABER) as bench:
        with bench.stage as stage:
            stage.home()
            stage.move_to(150.0, TIMEOUT_S)
        with bench.stage as stage:
            assert stage.position_mm == pytest.approx(150.0)
            assert stage.move_to(160.0, TIMEOUT_S) == pytest.approx(160.0)
        bench.wire.hard_reset()
        bench.clock.sleep_s(2.0)
        with bench.stage as stage, pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm


def test_a_stage_found_moving_is_stopped() -> None:
    with simulated_bench(ZABER) as bench:
        with bench.stage as stage:
            stage.home()
        bench.wire.receive(b"/1 1 move max\n")
        bench.clock.sleep_s(0.5)
        assert bench.is_moving()
        with bench.stage as stage:
            assert not bench.is_moving()
            with pytest.raises(StageAlarmError, match="home the stage first"):
                _ = stage.position_mm


# -- homing ---------------------------------------------------------------------------------------


def test_homing_may_be_forbidden() -> None:
    config = ZABER.model_copy(update={"may_move": False})
    with simulated_bench(config, before=Scripted) as bench, bench.stage as stage:
        with pytest.raises(ConfigError, match="may_move is false"):
            stage.home()
        with pytest.raises(ConfigError, match="may_move is false"):
            stage.move_to(150.0, TIMEOUT_S)
        assert b"home" not in scripted(bench).sent


def test_a_missing_home_sensor_is_told() -> None:
    carriage = CARRIAGE.model_copy(update={"has_switch": False})
    with simulated_bench(ZABER, carriage=carriage) as bench, bench.stage as stage:
        with pytest.raises(StageAlarmError, match="FS: stalled and stopped") as caught:
            stage.home()
        assert caught.value.code == "FS"
        assert not bench.is_moving()


def test_homing_that_takes_too_long_is_stopped() -> None:
    config = ZABER.model_copy(update={"homing_timeout_s": 0.3})
    with simulated_bench(config) as bench, bench.stage as stage:
        with pytest.raises(StageTimeoutError, match=r"homing did not end within 0\.3 s"):
            stage.home()
        assert not bench.is_moving()
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm


def test_the_motor_is_switched_off_at_the_end_and_on_by_homing() -> None:
    config = ZABER.model_copy(update={"motor_off_at_end": True})
    with simulated_bench(config) as bench:
        with bench.stage as stage:
            stage.home()
        assert "FO" in zaber_of(bench).axis.flags
        with bench.stage as stage:
            with pytest.raises(StageAlarmError, match="home the stage first"):
                stage.move_to(150.0, TIMEOUT_S)
            stage.home()
            assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
