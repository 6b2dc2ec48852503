"""The GRBL stage against the simulated controller: truth, opening and homing."""

import pytest
from rig_drivers.grbl.controller import grbl_stage
from rig_sim.clock import VirtualClock

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
    MICROSTEP_MM,
    STAGE,
    TIMEOUT_S,
    URL,
    simulated_bench,
)

# -- where the board really is ------------------------------------------------------------------


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
    with simulated_bench(config, before=Scripted) as bench:
        # It promises a search at 16.7 m/s, so that only the switch tells how long it takes.
        scripted(bench).on_transmit = lambda data: data.replace(b"$25=6000", b"$25=999999")
        with (
            bench.stage as stage,
            pytest.raises(StageTimeoutError, match=r"\$H got no answer within 0\.4 s"),
        ):
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
