"""Trouble of the Marlin stage: what goes wrong on the way is caught, and told with what to do."""

import pytest

from rig.errors import (
    ConfigError,
    DeviceLostError,
    StageAlarmError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import MarlinFirmwareConfig
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import (
    FIRMWARE,
    MARLIN,
    MICROSTEP_MM,
    TIMEOUT_S,
    Bench,
    simulated_bench,
)


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
