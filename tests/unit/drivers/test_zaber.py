"""The Zaber stage against a simulated chain: truth, trouble, and what is told of it."""

from collections.abc import Callable

import pytest

from rig.errors import (
    ConfigError,
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import ZaberFirmwareConfig
from sim.firmware.zaber import ZaberFirmware
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import CARRIAGE, FIRMWARE, URL, ZABER, Bench, simulated_bench

TIMEOUT_S = 20.0
MICROSTEP_MM = 0.003


def firmware_with(**changes: object):
    return FIRMWARE.model_copy(update={"zaber": ZaberFirmwareConfig.model_validate(changes)})


def device_of(bench: Bench) -> ZaberFirmware:
    assert isinstance(bench.wire, ZaberFirmware)
    return bench.wire


@pytest.mark.parametrize("places_mm", [(120.0, 150.0, 190.0), (190.0, 150.0, 120.0, 119.0)])
def test_with_an_approach_backlash_leaves_no_error(places_mm: tuple[float, ...]) -> None:
    with simulated_bench(ZABER) as bench, bench.stage as stage:
        stage.home()
        for wanted_mm in places_mm:
            assert stage.move_to(wanted_mm, TIMEOUT_S) == pytest.approx(wanted_mm, abs=MICROSTEP_MM)
            assert bench.true_mm() == pytest.approx(wanted_mm, abs=MICROSTEP_MM)


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
        assert "FO" in device_of(bench).axis.flags
        with bench.stage as stage:
            with pytest.raises(StageAlarmError, match="home the stage first"):
                stage.move_to(150.0, TIMEOUT_S)
            stage.home()
            assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


# -- trouble --------------------------------------------------------------------------------------


def test_a_stall_in_motion_costs_the_position() -> None:
    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, bench.wire.trip)
        with pytest.raises(StageAlarmError, match="FS: stalled and stopped; clear the way"):
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()
        with pytest.raises(StageAlarmError, match="home the stage first"):
            stage.move_to(120.0, TIMEOUT_S)
        stage.home()
        stage.move_to(120.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(120.0, abs=MICROSTEP_MM)


def test_a_loss_of_power_in_motion_is_told() -> None:
    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, bench.wire.hard_reset)
        with pytest.raises(StageTimeoutError, match="no answer within"):
            stage.move_to(120.0, TIMEOUT_S)
        bench.clock.sleep_s(3.0)
        with pytest.raises(StageAlarmError, match="WR: no reference position"):
            stage.move_to(120.0, TIMEOUT_S)
        stage.home()
        stage.move_to(120.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(120.0, abs=MICROSTEP_MM)


def test_a_turned_knob_is_told_once() -> None:
    with simulated_bench(ZABER) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        device_of(bench).axis.turn_knob(5.0)
        bench.clock.sleep_s(3.0)
        with pytest.raises(StageAlarmError, match="by the knob or another program") as caught:
            _ = stage.position_mm
        assert caught.value.code == "NI"
        assert stage.position_mm == pytest.approx(145.0, abs=MICROSTEP_MM)
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


def test_a_knob_turned_during_a_move_ends_it() -> None:
    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        firmware = scripted(bench).firmware
        assert isinstance(firmware, ZaberFirmware)
        during_the_move(bench, lambda: firmware.axis.turn_knob(3.0))
        with pytest.raises(StageAlarmError, match="knob"):
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()


def test_a_stage_that_stops_short_is_caught() -> None:
    def nearer(data: bytes) -> bytes:
        return data.replace(b"move abs 36800", b"move abs 36000").split(b":")[0] + b"\n"

    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_receive = nearer
        with pytest.raises(StagePositionError, match=r"sent to 118\.000 mm, reads 120\.000 mm"):
            stage.move_to(120.0, TIMEOUT_S)


def test_a_device_that_claims_to_have_arrived_is_caught() -> None:
    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, lambda: bench.wire.lie(1000))
        with pytest.raises(StageAlarmError, match="that takes at least") as caught:
            stage.move_to(120.0, TIMEOUT_S)
        assert caught.value.code == "too early"
        assert not bench.is_moving()


def test_where_braking_does_not_help_the_stage_is_stopped_dead() -> None:
    def without_stop(data: bytes) -> bytes:
        return b"" if b" stop" in data else data

    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_receive = without_stop
        with pytest.raises(StageTimeoutError):
            stage.move_to(120.0, 0.5)
        assert not bench.is_moving()
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm


def test_a_silent_chain_is_told_as_danger() -> None:
    with (
        simulated_bench(ZABER, before=Scripted) as bench,
        pytest.raises(DeviceLostError, match="switch its supply off"),
        bench.stage as stage,
    ):
        stage.home()
        during_the_move(bench, lambda: setattr(scripted(bench), "on_transmit", lambda _: b""))
        stage.move_to(120.0, TIMEOUT_S)


def test_a_lost_answer_to_a_question_is_asked_for_again() -> None:
    dropped: list[bytes] = []

    def drop_once(data: bytes) -> bytes:
        if b"OK" in data and len(dropped) < 2:
            dropped.append(data)
            return b""
        return data

    with simulated_bench(ZABER, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = drop_once
        assert stage.position_mm == pytest.approx(210.0)
        assert len(dropped) == 2


def test_a_refused_move_says_why() -> None:
    def shrink(bench: Bench) -> Callable[[], None]:
        return lambda: bench.wire.receive(b"/1 1 set limit.max 1000\n")

    with simulated_bench(ZABER) as bench, bench.stage as stage:
        stage.home()
        shrink(bench)()
        with pytest.raises(StageAlarmError, match=r"RJ BADDATA: .*limit\.max") as caught:
            stage.move_to(120.0, TIMEOUT_S)
        assert caught.value.code == "BADDATA"
