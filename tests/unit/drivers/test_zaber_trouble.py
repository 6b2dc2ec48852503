"""Trouble of the Zaber stage: what goes wrong on the way is caught, and told with what to do."""

from collections.abc import Callable

import pytest
from rig_sim.firmware.zaber import ZaberFirmware

from rig.errors import (
    DeviceLostError,
    StageAlarmError,
    StagePositionError,
    StageTimeoutError,
)
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import (
    MICROSTEP_MM,
    TIMEOUT_S,
    ZABER,
    Bench,
    simulated_bench,
    zaber_of,
)


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
        zaber_of(bench).axis.turn_knob(5.0)
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
