"""Trouble of the GRBL stage: what goes wrong on the way is caught, and told with what to do."""

import pytest

from rig.errors import (
    DeviceLostError,
    StageAlarmError,
    StagePositionError,
)
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import (
    MICROSTEP_MM,
    STAGE,
    TIMEOUT_S,
    simulated_bench,
)


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
