"""The Marlin stage against a simulated controller: truth, trouble, and what is told of it."""

import pytest

from drivers.marlin_dialect import numbered_line
from rig.errors import (
    ConfigError,
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import MarlinFirmwareConfig
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import CARRIAGE, FIRMWARE, MARLIN, URL, Bench, simulated_bench

TIMEOUT_S = 20.0
MICROSTEP_MM = 0.003


@pytest.mark.parametrize("places_mm", [(120.0, 150.0, 190.0), (190.0, 150.0, 120.0, 119.0)])
def test_with_an_approach_backlash_leaves_no_error(places_mm: tuple[float, ...]) -> None:
    with simulated_bench(MARLIN) as bench, bench.stage as stage:
        stage.home()
        for wanted_mm in places_mm:
            assert stage.move_to(wanted_mm, TIMEOUT_S) == pytest.approx(wanted_mm, abs=MICROSTEP_MM)
            assert bench.true_mm() == pytest.approx(wanted_mm, abs=MICROSTEP_MM)


def test_positions_are_finer_than_the_printed_hundredths() -> None:
    with simulated_bench(MARLIN) as bench, bench.stage as stage:
        stage.home()
        assert stage.move_to(150.0075, TIMEOUT_S) == pytest.approx(150.0075, abs=1e-9)
        assert bench.true_mm() == pytest.approx(150.0075, abs=1e-6)


def test_it_knows_the_controller() -> None:
    with simulated_bench(MARLIN) as bench, bench.stage as stage:
        assert stage.identity == {
            "kind": "marlin",
            "port": URL,
            "version": "Marlin 2.1.2.1 (May 16 2023 12:00:00)",
            "machine": "3D Printer",
            "uuid": "cede2a2f-41a2-4748-9b12-c55c62f367ff",
            "emergency_parser": "yes",
        }


def test_every_line_carries_its_number_and_checksum() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        lines = [line for line in scripted(bench).sent.split(b"\n") if line]
        for line in lines:
            body = line.rpartition(b"*")[0].decode()
            number, _, text = body.partition(" ")
            assert numbered_line(int(number[1:]), text).strip() == line


def test_a_long_move_is_no_silence() -> None:
    slow = MARLIN.model_copy(update={"speed_mm_s": 4.0})
    with simulated_bench(slow) as bench, bench.stage as stage:
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


def test_a_controller_slower_than_it_says_is_waited_for() -> None:
    with simulated_bench(MARLIN) as bench, bench.stage as stage:
        stage.home()
        bench.wire.receive(b"M220 S10\n")
        bench.clock.sleep_s(0.1)
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)


# -- opening --------------------------------------------------------------------------------------


def test_a_board_that_does_not_reset_on_opening_is_found() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench:
        bench.clock.sleep_s(5.0)
        bench.wire.receive(b"N0 M110 N77*89\nhalf a li")
        bench.wire.transmit()
        scripted(bench).port_opened = lambda: None
        with bench.stage as stage:
            stage.home()
            assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (b"", b"", "nothing answered"),
        (b"FIRMWARE_NAME:Marlin 2.1.2.1", b"FIRMWARE_NAME:Repetier_1.0", "found 'Repetier_1.0"),
    ],
)
def test_what_is_not_marlin_is_refused(before: bytes, after: bytes, expected: str) -> None:
    with (
        simulated_bench(MARLIN, before=Scripted) as bench,
        pytest.raises(DeviceNotFoundError, match=expected),
    ):
        scripted(bench).on_transmit = lambda data: data.replace(before, after) if before else b""
        bench.stage.__enter__()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"travel_mm": (85.0, 200.0)}, r"needs 83\.0\.\.200\.0 mm.*M211 allows 90\.0"),
        ({"travel_mm": (110.0, 211.0)}, r"needs 108\.0\.\.211\.0 mm"),
        ({"speed_mm_s": 101.0}, r"speed_mm_s is 101\.0, the controller's M203 allows 100\.0"),
    ],
)
def test_a_profile_that_the_controller_cannot_keep_is_refused(
    changes: dict[str, object], expected: str
) -> None:
    with (
        simulated_bench(MARLIN.model_copy(update=changes)) as bench,
        pytest.raises(ConfigError, match=expected),
    ):
        bench.stage.__enter__()


def test_a_controller_without_soft_end_stops_is_refused() -> None:
    firmware = FIRMWARE.model_copy(update={"soft_limits": False})
    with (
        simulated_bench(MARLIN, firmware) as bench,
        pytest.raises(ConfigError, match=r"soft end stops are off .* send M211 S1"),
    ):
        bench.stage.__enter__()


# -- homing ---------------------------------------------------------------------------------------


def test_a_missing_switch_halts_the_controller() -> None:
    carriage = CARRIAGE.model_copy(update={"has_switch": False})
    with simulated_bench(MARLIN, carriage=carriage) as bench, bench.stage as stage:
        with pytest.raises(StageAlarmError, match="switch the controller off and on") as caught:
            stage.home()
        assert caught.value.code == "killed"
        with pytest.raises(StageAlarmError, match="has halted"):
            stage.home()


def test_homing_that_takes_too_long_is_ended_by_an_emergency_stop() -> None:
    config = MARLIN.model_copy(update={"homing_timeout_s": 0.4})
    with simulated_bench(config) as bench:
        with bench.stage as stage:
            with pytest.raises(StageTimeoutError, match=r"G28 X got no answer within 0\.4 s"):
                stage.home()
            assert not bench.is_moving()
            with pytest.raises(StageAlarmError, match="open it again, then home"):
                stage.home()
        with bench.stage as stage:
            assert stage.identity["kind"] == "marlin"


def test_the_motor_is_switched_off_at_the_end_where_the_profile_wants_it() -> None:
    config = MARLIN.model_copy(update={"motor_off_at_end": True})
    with simulated_bench(config, before=Scripted) as bench:
        with bench.stage as stage:
            stage.home()
        assert b"M18 X*" in scripted(bench).sent.splitlines()[-1]


# -- trouble --------------------------------------------------------------------------------------


def test_a_target_beyond_the_soft_end_stops_is_clamped_in_silence_and_caught() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        narrow(bench, 50.0)
        with pytest.raises(StagePositionError, match=r"sent to 118\.000 mm, reads 160\.000 mm"):
            stage.move_to(120.0, TIMEOUT_S)


def narrow(bench: Bench, high_mm: float) -> None:
    """Let the controller forget how far it may go, as wrong settings would."""
    firmware = scripted(bench).firmware
    firmware._chip.settings.range_mm["X"] = (0.0, high_mm)  # pyright: ignore


def test_a_kill_in_motion_is_told() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, bench.wire.trip)
        with pytest.raises(StageAlarmError, match="Thermal Runaway"):
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()
        with pytest.raises(StageAlarmError, match="has halted") as caught:
            stage.move_to(120.0, TIMEOUT_S)
        assert caught.value.code == "killed"


def test_a_reset_in_motion_loses_the_position() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, bench.wire.hard_reset)
        with pytest.raises(StageAlarmError, match="position is lost") as caught:
            stage.move_to(120.0, TIMEOUT_S)
        assert caught.value.code == "reset"
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm
        stage.home()
        stage.move_to(120.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(120.0, abs=MICROSTEP_MM)


@pytest.mark.parametrize("emergency_parser", [True, False])
def test_a_quick_stop_costs_the_position(emergency_parser: bool) -> None:
    marlin = MarlinFirmwareConfig(emergency_parser=emergency_parser)
    firmware = FIRMWARE.model_copy(update={"marlin": marlin})
    with simulated_bench(MARLIN, firmware) as bench, bench.stage as stage:
        stage.home()
        start_s = bench.clock.now_s()
        with pytest.raises(StageTimeoutError, match="still not at rest"):
            stage.move_to(120.0, 0.6)
        assert not bench.is_moving()
        assert bench.clock.now_s() - start_s < 1.2
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm


def test_a_controller_stopped_by_an_error_is_freed_by_homing() -> None:
    said: list[bytes] = []

    def stop_once(data: bytes) -> bytes:
        if b"G1 " in scripted(bench).sent and not said:
            said.append(data)
            return b"Error:Printer stopped due to errors. Fix the error and use M999\nok\n"
        return data

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        assert b"M999" not in scripted(bench).sent
        scripted(bench).on_transmit = stop_once
        with pytest.raises(StageAlarmError, match="clear its cause, then home") as caught:
            stage.move_to(120.0, TIMEOUT_S)
        assert caught.value.code == "stopped by error"
        stage.home()
        assert b"M999 S1" in scripted(bench).sent
        assert stage.move_to(120.0, TIMEOUT_S) == pytest.approx(120.0)


def test_an_interrupt_stops_the_stage_and_passes_on() -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, interrupt)
        with pytest.raises(KeyboardInterrupt):
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()


def test_a_damaged_line_is_sent_again_and_nothing_is_done_twice() -> None:
    damaged: list[bytes] = []

    def damage_once(data: bytes) -> bytes:
        if b"G1 " in data and not damaged:
            damaged.append(data)
            return data.replace(b"X", b"Y")
        return data

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_receive = damage_once
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert scripted(bench).sent.count(damaged[0]) == 2


def test_a_lost_ok_does_not_do_the_command_twice() -> None:
    lost: list[bytes] = []

    def lose_once(data: bytes) -> bytes:
        if b"G1 X60" in scripted(bench).sent and data == b"ok\n" and not lost:
            lost.append(data)
            return b""
        return data

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = lose_once
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert lost
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)


def test_a_wait_at_rest_that_is_lost_is_asked_for_again() -> None:
    lost: list[bytes] = []

    def lose_once(data: bytes) -> bytes:
        if b"M400" in data and not lost:
            lost.append(data)
            return b""
        return data

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_receive = lose_once
        assert stage.position_mm == pytest.approx(210.0)
        assert lost


def test_an_offset_between_coordinate_and_count_is_caught() -> None:
    def shift(data: bytes) -> bytes:
        return data.replace(b"X:60.00", b"X:59.50")

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = shift
        with pytest.raises(StageAlarmError, match=r"switch off offsets \(M206"):
            stage.move_to(150.0, TIMEOUT_S)


def test_motors_that_are_no_axes_are_refused() -> None:
    def corexy(data: bytes) -> bytes:
        return data.replace(b"Count X:0 Y:0 Z:0", b"Count A:0 B:0 C:0")

    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        scripted(bench).on_transmit = corexy
        with pytest.raises(ConfigError, match="CoreXY"):
            stage.home()


def test_silence_is_told_as_danger() -> None:
    with (
        simulated_bench(MARLIN, before=Scripted) as bench,
        pytest.raises(DeviceLostError, match="switch its supply off"),
        bench.stage as stage,
    ):
        stage.home()
        during_the_move(bench, lambda: setattr(scripted(bench), "on_transmit", lambda _: b""))
        stage.move_to(120.0, TIMEOUT_S)
