"""Builds of Marlin as people have them: other axes, heaters, idle switch-off, late answers."""

import pytest
from rig_drivers.marlin.dialect import Position, Remark, Trouble, numbered_line, parse_reply
from rig_drivers.marlin.link import KILL_S

from rig.errors import ConfigError, DeviceNotFoundError, StageAlarmError
from rig.profile import FirmwareConfig, MarlinFirmwareConfig
from tests.support.scripted_wire import Scripted, during_the_move, scripted
from tests.support.stages import FIRMWARE, MARLIN, MICROSTEP_MM, TIMEOUT_S, Bench, simulated_bench


def build(**changes: object) -> FirmwareConfig:
    marlin = MarlinFirmwareConfig().model_copy(update=changes)
    return FIRMWARE.model_copy(update={"marlin": marlin})


# -- axes -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("X:10.00 Count X:800", Position((10.0,), (800,), "X")),
        ("X:10.00 Y:-2.50 Count X:800 Y:-200", Position((10.0, -2.5), (800, -200), "XY")),
        (
            "X:10.00 Y:0.00 Z:0.00 A:7.00 E:0.00 Count X:800 Y:0 Z:0 A:560",
            Position((10.0, 0.0, 0.0, 7.0), (800, 0, 0, 560), "XYZA"),
        ),
        (
            "X:1.00 Y:2.00 Z:3.00 A:4.00 B:5.00 C:6.00 U:7.00 V:8.00 W:9.00 E:0.00 "
            "Count X:1 Y:2 Z:3 A:4 B:5 C:6 U:7 V:8 W:9",
            Position(tuple(float(n) for n in range(1, 10)), tuple(range(1, 10)), "XYZABCUVW"),
        ),
        ("X:1.00 Y:2.00 Count A:80 B:80", Position((1.0, 2.0), None, "XY")),
        ("X:1.00 Y:2.00", Position((1.0, 2.0), None, "XY")),
    ],
)
def test_one_to_nine_axes_are_read(line: str, reply: Position) -> None:
    assert parse_reply(line) == reply


@pytest.mark.parametrize(
    "line",
    [
        "X:10.00 Y:0.00 Count X:800",
        "X:10.00 X:10.00 Count X:800 X:800",
        "Y:10.00 Count Y:800",
        "X:10.00Count X:800",
        "X:1.00 Y:2.00 Z:3.00 A:4.00 B:5.00 C:6.00 U:7.00 V:8.00 W:9.00 I:1.00",
    ],
)
def test_a_damaged_position_is_none(line: str) -> None:
    assert parse_reply(line) == Remark(line)


@pytest.mark.parametrize("axes", [1, 2, 4, 9])
def test_the_stage_moves_whatever_axes_the_build_has(axes: int) -> None:
    with simulated_bench(MARLIN, build(axes=axes)) as bench, bench.stage as stage:
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)


def test_an_axis_that_the_build_lacks_is_named() -> None:
    config = MARLIN.model_copy(update={"axis": "Z", "speed_mm_s": 50.0})
    with (
        simulated_bench(config, build(axes=2)) as bench,
        bench.stage as stage,
        pytest.raises(ConfigError, match=r"axis is Z, the controller has X, Y \(M114\)"),
    ):
        stage.home()


# -- heaters --------------------------------------------------------------------------------------

MINTEMP = b"Error:Heater ID: E0 MINTEMP triggered\n"
KILLED = b"Error:Printer halted. kill() called!\n"


def fail(bench: Bench, said: bytes) -> None:
    """Let the controller's heaters fail, as a board without a sensor does sooner or later."""
    firmware = scripted(bench).firmware
    firmware.trip()
    firmware.transmit()
    pending = [said]
    scripted(bench).on_transmit = lambda data: (pending.pop() if pending else b"") + data


def test_a_failing_heater_in_motion_is_told_at_once_as_what_it_is() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        during_the_move(bench, lambda: fail(bench, MINTEMP + KILLED))
        start_s = bench.clock.now_s()
        with pytest.raises(StageAlarmError, match="MINTEMP triggered") as caught:
            stage.move_to(120.0, TIMEOUT_S)
        assert caught.value.code == "failing"
        assert "TEMP_SENSOR 0" in caught.value.advice
        assert bench.clock.now_s() - start_s < 2.0
        assert not bench.is_moving()
        with pytest.raises(StageAlarmError, match=r"halted \(kill\): Heater ID: E0 MINTEMP"):
            stage.home()


def test_a_fault_without_a_halt_is_stopped_all_the_same() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        pending = [MINTEMP]
        during_the_move(
            bench,
            lambda: setattr(
                scripted(bench),
                "on_transmit",
                lambda data: (pending.pop() if pending else b"") + data,
            ),
        )
        start_s = bench.clock.now_s()
        with pytest.raises(StageAlarmError, match="MINTEMP"):
            stage.move_to(120.0, TIMEOUT_S)
        assert not bench.is_moving()
        assert bench.clock.now_s() - start_s < 1.5 + KILL_S
        assert b"M410" in scripted(bench).sent


def test_a_board_that_has_halted_before_it_is_opened_is_told() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench:
        start = b"start\n" + MINTEMP + KILLED
        scripted(bench).on_transmit = lambda data: start if b"start" in data else b""
        with pytest.raises(StageAlarmError, match=r"MINTEMP triggered.*100 kOhm"):
            bench.stage.__enter__()


# -- current at rest ------------------------------------------------------------------------------


def test_the_idle_switch_off_is_switched_off() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        bench.clock.sleep_s(1000.0)
        assert stage.position_mm == pytest.approx(210.0)
        assert b"M84 S0" in scripted(bench).sent


def refused(bench: Bench) -> bytes:
    """Damage one command into another one that no Marlin knows."""
    number = scripted(bench).sent.rpartition(b"N")[2].partition(b" ")[0]
    return numbered_line(int(number), "M9999")


def test_where_it_cannot_be_switched_off_a_long_rest_costs_the_position() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench:
        scripted(bench).on_receive = lambda data: refused(bench) if b"M84" in data else data
        with bench.stage as stage:
            stage.home()
            bench.clock.sleep_s(119.0)
            assert stage.position_mm == pytest.approx(210.0)
            bench.clock.sleep_s(2.0)
            with pytest.raises(StageAlarmError, match="home the stage first"):
                _ = stage.position_mm


# -- late answers, and others ---------------------------------------------------------------------


def test_answers_after_their_ok_are_heard() -> None:
    with simulated_bench(MARLIN, build(answers_late=True)) as bench, bench.stage as stage:
        assert stage.identity["version"].startswith("Marlin 2.1.2.1")
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)


@pytest.mark.parametrize(
    "line",
    [
        "// Klipper state: Ready",
        '// Unknown command:"M115"',
        "!! Printer is not ready",
        "!! Shutdown due to webhooks request",
    ],
)
def test_what_klipper_says_is_known(line: str) -> None:
    assert parse_reply(line) == Trouble(line)


def test_what_a_host_is_told_is_no_klipper() -> None:
    assert parse_reply("//action:pause") == Remark("//action:pause")


def test_klippers_console_is_refused_in_one_sentence() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench:
        wire = scripted(bench)
        heard: list[bytes] = []

        def answer(data: bytes) -> bytes:
            lines, heard[:] = list(heard), []
            said = b""
            for line in lines:
                word = line.partition(b" ")[2].partition(b"*")[0]
                said += b"" if b"M110" in word else b'// Unknown command:"' + word[:4] + b'"\n'
                said += b"ok\n"
            return said

        def listen(data: bytes) -> bytes:
            heard.extend(line for line in data.split(b"\n") if line)
            return b""

        wire.on_receive, wire.on_transmit = listen, answer
        with pytest.raises(DeviceNotFoundError, match=r"asked for Marlin, found Klipper") as caught:
            bench.stage.__enter__()
        assert "put Marlin 2 or grblHAL on the board" in caught.value.advice


@pytest.mark.parametrize("answer", [b"%s\nok\n", b"ok %s\n"])
def test_a_klipper_that_gives_its_name_is_refused_alike(answer: bytes) -> None:
    """With `[respond]` it speaks the token, and tells its name in the line of its `ok`."""
    name = b"FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12.0-102-g9f41f53c"
    with simulated_bench(MARLIN, before=Scripted) as bench:
        scripted(bench).on_transmit = lambda data: (
            answer % name if b"FIRMWARE_NAME" in data else data
        )
        with pytest.raises(DeviceNotFoundError, match=r"found Klipper \(M115: Klipper\)"):
            bench.stage.__enter__()


def test_a_klipper_that_is_not_ready_is_refused_at_once() -> None:
    """It answers every command but a few with its state, the last line behind `!!`."""
    state = b"// Printer is not ready\n// The klippy host software is attempting to connect.\n"
    with simulated_bench(MARLIN, before=Scripted) as bench:
        wire = scripted(bench)
        heard: list[bytes] = []

        def answer(data: bytes) -> bytes:
            lines, heard[:] = list(heard), []
            silent = b"".join(b"ok\n" for line in lines if b"M110" in line)
            return silent + b"".join(
                state + b"!! Printer is not ready\nok\n" for line in lines if b"M110" not in line
            )

        def listen(data: bytes) -> bytes:
            heard.extend(line for line in data.split(b"\n") if line)
            return b""

        wire.on_receive, wire.on_transmit = listen, answer
        start_s = bench.clock.now_s()
        with pytest.raises(DeviceNotFoundError, match="found Klipper"):
            bench.stage.__enter__()
        assert bench.clock.now_s() - start_s < 10.0


def test_a_switch_that_was_not_found_is_told_and_not_only_the_halt() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench, bench.stage as stage:
        wire = scripted(bench)

        def listen(data: bytes) -> bytes:
            if b"G28" in data:
                fail(bench, b"echo:Homing Failed\n" + KILLED)
            return data

        wire.on_receive = listen
        with pytest.raises(StageAlarmError, match="Homing Failed") as caught:
            stage.home()
        assert "check the switch" in caught.value.advice
        with pytest.raises(StageAlarmError, match=r"halted \(kill\): Homing Failed"):
            stage.home()


def test_a_build_without_a_sign_of_life_is_told_what_it_lacks() -> None:
    with simulated_bench(MARLIN, before=Scripted) as bench:
        scripted(bench).on_receive = lambda data: refused(bench) if b"M113" in data else data
        with pytest.raises(StageAlarmError, match="HOST_KEEPALIVE_FEATURE"):
            bench.stage.__enter__()
