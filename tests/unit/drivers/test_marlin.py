"""The Marlin stage against a simulated controller: truth, opening and homing."""

import pytest
from rig_drivers.marlin.dialect import numbered_line

from rig.errors import (
    ConfigError,
    DeviceNotFoundError,
    StageAlarmError,
    StageTimeoutError,
)
from tests.support.scripted_wire import Scripted, scripted
from tests.support.stages import (
    CARRIAGE,
    FIRMWARE,
    MARLIN,
    MICROSTEP_MM,
    TIMEOUT_S,
    URL,
    simulated_bench,
)


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
