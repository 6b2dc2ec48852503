"""The GRBL stage against the simulated controller: truth, trouble, and what is told of it."""

import pytest

from drivers.grbl import grbl_stage
from rig.errors import (
    ConfigError,
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import FirmwareConfig
from sim.clock import VirtualClock
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import CARRIAGE, FIRMWARE, STAGE, URL, simulated_bench

TIMEOUT_S = 20.0
MICROSTEP_MM = 0.003


# -- where the board really is ------------------------------------------------------------------


@pytest.mark.parametrize("places_mm", [(120.0, 150.0, 190.0), (190.0, 150.0, 120.0, 119.0)])
def test_with_an_approach_backlash_leaves_no_error(places_mm: tuple[float, ...]) -> None:
    with simulated_bench() as bench, bench.stage as stage:
        stage.home()
        for wanted_mm in places_mm:
            stage.move_to(wanted_mm, TIMEOUT_S)
            assert bench.true_mm() == pytest.approx(wanted_mm, abs=MICROSTEP_MM)


def test_without_an_approach_backlash_is_the_error() -> None:
    plain = STAGE.model_copy(update={"approach_mm": 0.0})
    with simulated_bench(plain) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(150.0 + 0.12, abs=MICROSTEP_MM)
        stage.move_to(190.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(190.0, abs=MICROSTEP_MM)
        stage.move_to(150.0, TIMEOUT_S)
        assert bench.true_mm() == pytest.approx(150.0 + 0.12, abs=MICROSTEP_MM)


def test_going_farther_goes_straight_and_nearer_comes_back() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(120.0, TIMEOUT_S)
        for wanted_mm, targets in ((150.0, [b"X-60.000"]), (140.0, [b"X-72.000", b"X-70.000"])):
            scripted(bench).sent = b""
            stage.move_to(wanted_mm, TIMEOUT_S)
            jogs = [line for line in scripted(bench).sent.split(b"\n") if b"$J=" in line]
            assert [jog.split(b"G90")[1].split(b"F")[0] for jog in jogs] == targets


def test_a_stage_turned_round_counts_the_other_way() -> None:
    turned = STAGE.model_copy(update={"direction": -1, "distance_at_machine_zero_mm": 100.0})
    with simulated_bench(turned) as bench, bench.stage as stage:
        stage.home()
        assert stage.position_mm == pytest.approx(102.0)
        assert stage.move_to(180.0, TIMEOUT_S) == pytest.approx(180.0)
        assert bench.carriage.travelled_mm(bench.clock.now_s() + 9.0) == pytest.approx(
            -80.0 + 0.12, abs=MICROSTEP_MM
        )


def test_work_coordinates_are_understood() -> None:
    with simulated_bench(before=Scripted) as bench:
        bench.wire.receive(b"")
        bench.clock.sleep_s(3.0)
        bench.wire.receive(b"$10=0\n")
        with bench.stage as stage:
            stage.home()
            bench.wire.receive(b"G92X33\n")
            assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
            assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)


def test_every_line_fits_the_controller() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(150.0, TIMEOUT_S)
        assert max(len(line) for line in scripted(bench).sent.split(b"\n")) < 80


# -- opening --------------------------------------------------------------------------------------


def test_it_knows_the_controller() -> None:
    with simulated_bench() as bench, bench.stage as stage:
        assert stage.identity == {
            "kind": "grbl",
            "port": URL,
            "firmware": "grbl",
            "version": "1.1h",
            "build": "1.1h.20190830:",
            "options": "V,15,128",
        }


def test_the_banner_is_waited_for_without_a_reset() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage:
        assert b"\x18" not in scripted(bench).sent


def test_a_board_that_does_not_reset_on_opening_is_reset() -> None:
    with simulated_bench(before=Scripted) as bench:
        wire = scripted(bench)
        bench.clock.sleep_s(5.0)
        bench.wire.transmit()
        wire.port_opened = lambda: None  # the DTR line of this adapter is not connected
        with bench.stage as stage:
            assert wire.sent.startswith(b"\x18")
            stage.home()


def test_a_port_where_nothing_is_plugged_in_is_not_found() -> None:
    with pytest.raises(DeviceNotFoundError, match="no port sim://test-stage"):
        grbl_stage(STAGE, VirtualClock()).__enter__()


def test_a_port_in_use_is_told() -> None:
    with simulated_bench() as bench, bench.stage:
        other = grbl_stage(STAGE, bench.clock)
        with pytest.raises(DeviceNotFoundError, match="used by another program"):
            other.__enter__()


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (b"", "no banner came within 6 s"),
        (b"\r\nGrbl 0.9j ['$' for help]\r\n", "found GRBL 0.9j, this driver needs 1.1"),
        (b"\xff\x00start\r\necho:Marlin\r\n", "no banner came"),
    ],
)
def test_what_is_not_grbl_is_refused(said: bytes, expected: str) -> None:
    with simulated_bench(before=Scripted) as bench:
        answers = iter([said])
        scripted(bench).on_transmit = lambda data: next(answers, b"") if data else b""
        with pytest.raises(DeviceNotFoundError, match=expected):
            bench.stage.__enter__()
        scripted(bench).on_transmit = lambda data: data
        with bench.stage as stage:
            stage.home()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"travel_mm": (85.0, 200.0)}, r"needs 83\.0\.\.200\.0 mm.*\$130 allows 90\.0\.\.210\.0"),
        ({"travel_mm": (91.0, 200.0)}, r"needs 89\.0\.\.200\.0 mm"),
        ({"travel_mm": (110.0, 211.0)}, r"needs 108\.0\.\.211\.0 mm"),
        ({"speed_mm_s": 101.0}, r"speed_mm_s is 101\.0, the controller's \$110 allows 100\.0"),
        ({"axis": "Z"}, r"\$112 allows 8\.3 mm/s"),
    ],
)
def test_a_profile_that_the_controller_cannot_keep_is_refused(
    changes: dict[str, object], expected: str
) -> None:
    with (
        simulated_bench(STAGE.model_copy(update=changes)) as bench,
        pytest.raises(ConfigError, match=expected),
    ):
        bench.stage.__enter__()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"homing": False}, r"\$22=0.*send \$22=1"),
        ({"soft_limits": False}, r"\$20=0.*send \$20=1"),
    ],
)
def test_a_controller_that_is_not_safe_is_refused(
    changes: dict[str, object], expected: str
) -> None:
    firmware = FIRMWARE.model_copy(update=changes)
    with simulated_bench(firmware=firmware) as bench:
        with pytest.raises(ConfigError, match=expected):
            bench.stage.__enter__()
        with pytest.raises(ConfigError, match=expected):  # the port was given back
            bench.stage.__enter__()


# -- homing ---------------------------------------------------------------------------------------


def test_homing_may_be_forbidden() -> None:
    config = STAGE.model_copy(update={"may_move": False})
    with simulated_bench(config, before=Scripted) as bench, bench.stage as stage:
        with pytest.raises(ConfigError, match="may_move is false"):
            stage.home()
        assert b"$H" not in scripted(bench).sent


def test_a_missing_switch_is_told() -> None:
    carriage = CARRIAGE.model_copy(update={"has_switch": False})
    with simulated_bench(carriage=carriage) as bench, bench.stage as stage:
        with pytest.raises(StageAlarmError, match="no limit switch was found") as caught:
            stage.home()
        assert caught.value.code == "ALARM:9"
        with pytest.raises(StageAlarmError, match="home the stage first"):
            stage.move_to(150.0, TIMEOUT_S)


def test_homing_that_takes_too_long_is_stopped() -> None:
    config = STAGE.model_copy(update={"homing_timeout_s": 0.4})
    with simulated_bench(config) as bench, bench.stage as stage:
        with pytest.raises(StageTimeoutError, match=r"\$H got no answer within 0\.4 s"):
            stage.home()
        assert not bench.is_moving()


def test_a_locked_up_controller_is_freed_by_homing() -> None:
    with simulated_bench() as bench, bench.stage as stage:
        stage.home()
        bench.wire.receive(b"G0X5\n")
        with pytest.raises(StageAlarmError, match="soft limits") as caught:
            stage.move_to(150.0, TIMEOUT_S)
        assert caught.value.code == "ALARM:2"
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)


# -- trouble --------------------------------------------------------------------------------------


def test_a_reset_in_motion_loses_the_position() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, bench.wire.hard_reset)
        with pytest.raises(StageAlarmError, match="position is lost"):
            stage.move_to(120.0, TIMEOUT_S)
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm
        stage.home()
        assert stage.move_to(120.0, TIMEOUT_S) == pytest.approx(120.0)
        assert bench.true_mm() == pytest.approx(120.0, abs=MICROSTEP_MM)


def test_a_reset_at_rest_is_noticed_by_the_next_call() -> None:
    with simulated_bench() as bench, bench.stage as stage:
        stage.home()
        bench.wire.hard_reset()
        bench.clock.sleep_s(5.0)
        with pytest.raises(StageAlarmError, match="home"):
            _ = stage.position_mm
        with pytest.raises(StageAlarmError, match="home"):
            stage.move_to(120.0, TIMEOUT_S)


def test_a_feed_hold_by_somebody_else_is_an_error() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        wire = scripted(bench)
        during_the_move(bench, lambda: bench.wire.receive(b"!"))
        with pytest.raises(StagePositionError, match=r"sent to 118\.000 mm, reads"):
            stage.move_to(120.0, TIMEOUT_S)
        wire.on_receive = lambda data: data
        assert stage.move_to(120.0, TIMEOUT_S) == pytest.approx(120.0)


def test_an_interrupt_stops_the_stage_and_passes_on() -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, interrupt)
        with pytest.raises(KeyboardInterrupt):
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()
        stopped_mm = stage.position_mm
        assert 120.0 < stopped_mm < 208.0
        assert bench.true_mm() == pytest.approx(stopped_mm + 0.12, abs=MICROSTEP_MM)


def test_stopping_brakes_and_clears_what_was_queued() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        bench.wire.receive(b"$J=G53X-60F4800\n$J=G53X-100F4800\n")
        bench.clock.sleep_s(0.5)
        stage.stop()
        stopped_mm = stage.position_mm
        assert bench.true_mm() == pytest.approx(stopped_mm + 0.12, abs=MICROSTEP_MM)
        bench.wire.receive(b"~")
        bench.clock.sleep_s(5.0)
        assert stage.position_mm == stopped_mm


def test_stopping_while_homing_loses_the_position() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        stage.move_to(120.0, TIMEOUT_S)
        wire = scripted(bench)
        calls: list[int] = []

        def stop_once(data: bytes) -> bytes:
            calls.append(1)
            if len(calls) == 20:
                stage.stop()
            return data

        def receive(data: bytes) -> bytes:
            if b"$H" in data:
                wire.on_transmit = stop_once
            return data

        wire.on_receive = receive
        with pytest.raises(StageAlarmError):
            stage.home()
        assert not bench.is_moving()
        with pytest.raises(StageAlarmError, match="home"):
            _ = stage.position_mm


def test_leaving_by_an_exception_stops_the_stage() -> None:
    def fail() -> None:
        raise ZeroDivisionError

    with simulated_bench(before=Scripted) as bench:
        with pytest.raises(ZeroDivisionError), bench.stage as stage:
            stage.home()
            during_the_move(bench, fail)
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()


def test_a_vanished_port_is_told_with_what_to_do() -> None:
    def receive(data: bytes) -> bytes:
        if b"?" in data:
            raise OSError(5, "Input/output error")
        return data

    with (
        simulated_bench(before=Scripted) as bench,
        pytest.raises(DeviceLostError, match=r"Input/output error.*could not be stopped"),
        bench.stage as stage,
    ):
        stage.home()
        during_the_move(bench, lambda: setattr(scripted(bench), "on_receive", receive))
        stage.move_to(120.0, TIMEOUT_S)


def test_a_stage_that_stops_short_is_caught() -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_receive = lambda data: data.replace(b"X-92.000", b"X-90.000")
        with pytest.raises(StagePositionError, match=r"sent to 118\.000 mm, reads 120\.000 mm"):
            stage.move_to(120.0, TIMEOUT_S)


def test_a_stage_that_claims_to_have_arrived_is_caught() -> None:
    """Damaged reports that look good: one wrong report is outvoted by those that follow."""

    def lie_once(data: bytes) -> bytes:
        nonlocal lies
        if b"<Jog" in data and lies:
            lies -= 1
            return b"<Idle|MPos:-92.000,0.000,0.000|FS:0,0>\r\n"
        return data

    lies = 1
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = lie_once
        assert stage.move_to(120.0, TIMEOUT_S) == pytest.approx(120.0)
        assert lies == 0
        assert bench.true_mm() == pytest.approx(120.0, abs=MICROSTEP_MM)


def test_silence_is_told_as_danger() -> None:
    with (
        simulated_bench(before=Scripted) as bench,
        pytest.raises(DeviceLostError, match="switch its supply off"),
        bench.stage as stage,
    ):
        stage.home()
        during_the_move(bench, lambda: setattr(scripted(bench), "on_transmit", lambda _: b""))
        stage.move_to(120.0, TIMEOUT_S)


def test_the_motor_is_switched_off_at_the_end_where_the_profile_wants_it() -> None:
    config = STAGE.model_copy(update={"motor_off_at_end": True})
    with simulated_bench(config, before=Scripted) as bench:
        with bench.stage as stage:
            stage.home()
            stage.stop()
        assert scripted(bench).sent.endswith(b"$SLP\n")
        bench.wire.receive(b"?")
        assert b"<Sleep|" in bench.wire.transmit()
        with bench.stage as stage:
            stage.home()


# -- dialects -------------------------------------------------------------------------------------


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
