"""What controllers as they are sold do on the first day: homing, booting, states, settings."""

import pytest
from rig_drivers.grbl.dialect import Dialect, Message, parse_reply, standstill
from rig_drivers.grbl.homing import fluidnc_homing_time_s, homing_commands, homing_time_s
from rig_drivers.grbl.settings import (
    check_axis,
    fluidnc_motor_at_rest,
    motor_at_rest,
    read_axis,
)

from rig.errors import ConfigError, DeviceNotFoundError, StageAlarmError, StageTimeoutError
from rig.profile import FirmwareConfig
from tests.support.scripted_wire import Scripted, scripted
from tests.support.stages import (
    CARRIAGE,
    FIRMWARE,
    MICROSTEP_MM,
    STAGE,
    TIMEOUT_S,
    ZERO_MM,
    simulated_bench,
)

FACTORY: dict[int, float] = {
    1: 25, 13: 0, 20: 1, 22: 1, 23: 0, 24: 25.0, 25: 500.0, 26: 250, 27: 1.0, 110: 6000, 120: 400,
    130: 820.0,
}  # fmt: skip


def firmware_with(**changes: object) -> FirmwareConfig:
    return FIRMWARE.model_copy(update=changes)


@pytest.mark.parametrize(
    ("dialect", "options", "commands"),
    [
        (Dialect.GRBL, "V", ("$H",)),
        (Dialect.GRBL, "VH", ("$HY",)),
        (Dialect.GRBLHAL, "VNMSL", ("$HY", "$H")),
        (Dialect.GRBLHAL, "VNMHSL", ("$HY",)),
        (Dialect.FLUIDNC, "MPS", ("$HY",)),
    ],
)
def test_one_axis_is_homed_where_the_firmware_can(
    dialect: Dialect, options: str, commands: tuple[str, ...]
) -> None:
    assert homing_commands(dialect, options, "Y") == commands


@pytest.mark.parametrize("dialect", ["grblhal", "fluidnc"])
def test_one_switch_is_enough_for_grblhal_and_fluidnc(dialect: str) -> None:
    zero_mm = ZERO_MM - (2.0 if dialect == "fluidnc" else 0.0)
    config = STAGE.model_copy(update={"distance_at_machine_zero_mm": zero_mm})
    firmware = firmware_with(grbl_dialect=dialect, homes_z_first=True)
    with simulated_bench(config, firmware, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
        assert bench.true_mm() == pytest.approx(150.0, abs=MICROSTEP_MM)
        assert b"$HX\n" in scripted(bench).sent
        assert b"$H\n" not in scripted(bench).sent


@pytest.mark.parametrize("replaced", [None, b"$999=1"])
def test_a_grblhal_that_homes_no_single_axis_homes_all(replaced: bytes | None) -> None:
    """Fresh from its makers it says error:5 to `$HX`, a very old one error:3 (unknown)."""
    firmware = firmware_with(grbl_dialect="grblhal", homes_single_axis=replaced is not None)
    with simulated_bench(firmware=firmware, before=Scripted) as bench, bench.stage as stage:
        if replaced is not None:
            scripted(bench).on_receive = lambda data: data.replace(b"$HX", replaced)
        stage.home()
        assert scripted(bench).sent.count(b"$HX\n") == scripted(bench).sent.count(b"$H\n") == 1
        assert stage.position_mm == pytest.approx(ZERO_MM - 2.0)


def test_one_switch_on_a_fresh_grblhal_is_told_with_the_bit_that_mends_it() -> None:
    firmware = firmware_with(grbl_dialect="grblhal", homes_single_axis=False, homes_z_first=True)
    with (
        simulated_bench(firmware=firmware) as bench,
        bench.stage as stage,
        pytest.raises(StageAlarmError, match="ALARM:9") as caught,
    ):
        stage.home()
    assert "grblHAL: set bit 1 of $22" in caught.value.advice


def test_a_fluidnc_that_may_home_no_single_axis_names_its_key() -> None:
    firmware = firmware_with(grbl_dialect="fluidnc")
    with simulated_bench(firmware=firmware, before=Scripted) as bench, bench.stage as stage:
        wire = scripted(bench)
        wire.on_receive = lambda data: data.replace(b"$HX", b"$/no")
        wire.on_transmit = lambda data: data.replace(b"error:3", b"error:19")
        with pytest.raises(StageAlarmError, match="may not be homed alone") as caught:
            stage.home()
        assert "homing/allow_single_axis" in caught.value.advice


def test_one_switch_on_stock_firmware_is_told_with_the_build_options() -> None:
    firmware = firmware_with(homes_z_first=True)
    with simulated_bench(firmware=firmware) as bench, bench.stage as stage:
        with pytest.raises(StageAlarmError, match="stock GRBL begins with Z") as caught:
            stage.home()
        assert caught.value.code == "ALARM:9"
        for mends in (r"HOMING_CYCLE_0 (1<<X_AXIS)", "HOMING_SINGLE_AXIS_COMMANDS", "$23"):
            assert mends in caught.value.advice
        assert not bench.is_moving()


def test_a_single_axis_that_finds_no_switch_is_told_plainly() -> None:
    firmware = firmware_with(grbl_dialect="grblhal")
    with simulated_bench(firmware=firmware, before=Scripted) as bench, bench.stage as stage:
        scripted(bench).on_transmit = lambda data: data.replace(b"ok\r\n", b"ALARM:9\r\n")
        with pytest.raises(StageAlarmError, match="no limit switch was found") as caught:
            stage.home()
        assert "HOMING_CYCLE_0" not in caught.value.advice
        scripted(bench).on_transmit = lambda data: data


# -- settings -------------------------------------------------------------------------------------


def test_the_time_of_homing_is_foretold() -> None:
    """820 mm and twice 1 mm at 500 mm/min, 1 mm at 25 mm/min, four pauses of 0.25 s."""
    assert homing_time_s(FACTORY, 820.0) == pytest.approx(822.0 * 0.12 + 2.4 + 1.0)


@pytest.mark.parametrize("gone", [24, 25, 26, 27])
def test_without_its_settings_the_time_of_homing_is_unknown(gone: int) -> None:
    assert homing_time_s({n: v for n, v in FACTORY.items() if n != gone}, 820.0) is None
    assert homing_time_s(FACTORY | {25: 0.0}, 820.0) is None


def test_homing_that_cannot_end_in_time_is_refused_at_once() -> None:
    config = STAGE.model_copy(update={"homing_timeout_s": 60.0})
    axis = read_axis(FACTORY, "V", config, device="stage")
    with pytest.raises(ConfigError, match=r"homing takes up to 102 s .*homing_timeout_s is 60\.0"):
        check_axis(config, axis, device="stage")
    check_axis(config.model_copy(update={"homing_timeout_s": 103.0}), axis, device="stage")


@pytest.mark.parametrize(
    ("settings", "motor"),
    [({1: 255.0}, None), ({}, None), ({1: 25.0}, "25 ms"), ({1: 254.0}, "254 ms")],
)
def test_a_motor_that_lets_go_after_every_move_is_told(
    settings: dict[int, float], motor: str | None
) -> None:
    told = motor_at_rest(settings)
    assert set(told) == (set() if motor is None else {"motor"})
    assert motor is None or f"off {motor} after every move" in told["motor"]
    assert motor is None or "send $1=255" in told["motor"]


def test_the_motor_at_rest_is_part_of_the_identity() -> None:
    with simulated_bench(before=Scripted) as bench:
        scripted(bench).on_transmit = lambda data: data.replace(b"$1=255\r\n", b"$1=25\r\n")
        with bench.stage as stage:
            assert "send $1=255" in stage.identity["motor"]


FLUIDNC_HOMING = {
    "homing/seek_mm_per_min": "200.000", "homing/feed_mm_per_min": "50.000",
    "homing/settle_ms": "250", "motor0/pulloff_mm": "1.000",
}  # fmt: skip


def test_the_time_of_fluidncs_homing_is_foretold() -> None:
    """Its defaults over 820 mm: 246 s; three slow ways of 1 mm at 50 mm/min; four pauses."""
    time_s = fluidnc_homing_time_s(FLUIDNC_HOMING, 820.0)
    assert time_s == pytest.approx(246.0 + 3.6 + 1.0)


@pytest.mark.parametrize("key", FLUIDNC_HOMING)
def test_without_its_keys_the_time_of_fluidncs_homing_is_unknown(key: str) -> None:
    assert fluidnc_homing_time_s(FLUIDNC_HOMING | {key: ""}, 820.0) is None


@pytest.mark.parametrize("dialect", ["grbl", "grblhal", "fluidnc"])
def test_the_foretold_time_of_homing_is_about_what_it_takes(dialect: str) -> None:
    """From the far end of the travel, in the simulated firmware's own time."""
    firmware = firmware_with(
        grbl_dialect=dialect, homing_mm_s=25.0, homing_locate_mm_s=2.0, homing_pause_s=0.25
    )
    zero_mm = ZERO_MM - (2.0 if dialect == "fluidnc" else 0.0)
    config = STAGE.model_copy(
        update={"homing_timeout_s": 1.0, "distance_at_machine_zero_mm": zero_mm}
    )
    with (
        simulated_bench(config, firmware) as bench,
        pytest.raises(ConfigError, match="homing takes up to") as caught,
    ):
        bench.stage.__enter__()
    told = caught.value.found
    foretold_s = float(told.partition("up to ")[2].partition(" s")[0])
    assert ("$25" in told) == (dialect != "fluidnc")
    assert ("/axes/x/homing/seek_mm_per_min" in told) == (dialect == "fluidnc")
    config = config.model_copy(update={"homing_timeout_s": 60.0})
    far_end = CARRIAGE.model_copy(update={"power_up_mm": -119.0})
    with simulated_bench(config, firmware, far_end) as bench, bench.stage as stage:
        start_s = bench.clock.now_s()
        stage.home()
        took_s = bench.clock.now_s() - start_s
    assert took_s == pytest.approx(foretold_s, rel=0.3)


def test_a_fluidnc_is_told_in_the_names_of_its_file() -> None:
    firmware = firmware_with(grbl_dialect="fluidnc", max_rate_mm_s=10.0)
    with (
        simulated_bench(firmware=firmware) as bench,
        pytest.raises(ConfigError, match=r"/axes/x/max_rate_mm_per_min allows 10\.0 mm/s"),
    ):
        bench.stage.__enter__()


@pytest.mark.parametrize(("idle", "is_told"), [("250", True), ("255", False), ("", False)])
def test_fluidncs_motor_at_rest_is_told_too(idle: str, is_told: bool) -> None:
    told = fluidnc_motor_at_rest(idle)
    assert ("set it to 255" in told.get("motor", "")) == is_told


def test_messages_between_question_and_answer_are_no_value() -> None:
    firmware = firmware_with(grbl_dialect="fluidnc")
    with simulated_bench(firmware=firmware, before=Scripted) as bench:
        scripted(bench).on_transmit = lambda data: data.replace(
            b"ok\r\n", b"[MSG:INFO: Client connected]\r\nok\r\n"
        )
        with bench.stage as stage:
            assert stage.identity["firmware"] == "FluidNC"
            scripted(bench).on_transmit = lambda data: data


def test_what_grblhal_tells_of_itself_is_no_noise() -> None:
    for line in ("[NVS STORAGE:*FLASH]", "[DRIVER VERSION:240805]", "[COMPATIBILITY LEVEL:1]"):
        kind, _, text = line[1:-1].partition(":")
        assert parse_reply(line) == Message(kind, text)


def test_a_fluidnc_without_the_axis_is_told() -> None:
    firmware = firmware_with(grbl_dialect="fluidnc")
    with simulated_bench(firmware=firmware, before=Scripted) as bench:
        scripted(bench).on_receive = lambda data: data.replace(b"$/axes/x/", b"$/axes/none/")
        with pytest.raises(ConfigError, match=r"nothing of /axes/x.*no axis X.*\(\$SS\)"):
            bench.stage.__enter__()


# -- starting -------------------------------------------------------------------------------------


@pytest.mark.parametrize("connecting_s", [4.0, 10.0])
def test_a_controller_that_looks_for_its_network_is_waited_for(connecting_s: float) -> None:
    firmware = firmware_with(grbl_dialect="fluidnc", connecting_s=connecting_s)
    with simulated_bench(firmware=firmware, before=Scripted) as bench:
        start_s = bench.clock.now_s()
        with bench.stage as stage:
            assert stage.identity["firmware"] == "FluidNC"
            assert bench.clock.now_s() - start_s > connecting_s
            assert b"\x18" not in scripted(bench).sent


@pytest.mark.slow
def test_a_controller_that_never_ends_booting_is_given_up() -> None:
    firmware = firmware_with(grbl_dialect="fluidnc", connecting_s=1000.0)
    with simulated_bench(firmware=firmware) as bench:
        start_s = bench.clock.now_s()
        with pytest.raises(DeviceNotFoundError, match=r"no banner came within 120 s"):
            bench.stage.__enter__()
        assert bench.clock.now_s() - start_s == pytest.approx(120.0, abs=3.0)


# -- states ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ("Door:0", "the safety door was open and is closed again"),
        ("Door:1", "the safety door is open"),
        ("Tool", "a change of tool"),
        ("Sleep", "the motors have no current"),
        ("Check", "only checks G-code"),
        ("Alarm:11", "wants every axis to be homed"),
        ("Hold:0", "a feed hold"),
    ],
)
def test_a_state_at_rest_is_told_by_its_name_at_once(state: str, words: str) -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = lambda data: data.replace(b"<Idle", b"<" + state.encode())
        start_s = bench.clock.now_s()
        with pytest.raises(StageAlarmError, match=words) as caught:
            _ = stage.position_mm
        assert (caught.value.code, bool(caught.value.advice)) in {
            (state, True),
            ("not homed", True),
        }
        assert bench.clock.now_s() - start_s < 1.0
        scripted(bench).on_transmit = lambda data: data


@pytest.mark.parametrize("state", ["Door:2", "Door:3", "Run"])
def test_a_door_at_work_is_no_rest(state: str) -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        stage.home()
        scripted(bench).on_transmit = lambda data: data.replace(b"<Idle", b"<" + state.encode())
        with pytest.raises(StageTimeoutError, match="still not at rest"):
            _ = stage.position_mm
        scripted(bench).on_transmit = lambda data: data


def test_a_state_nobody_knows_is_told_as_it_is() -> None:
    error = standstill("stage", "asked for the position", "Parked")
    assert error.found == "stage: asked for the position, found the controller in state Parked"
    assert error.advice == "see what stopped it, then home again"


@pytest.mark.parametrize(
    "fields",
    ["|SP1:0,,|Pn:P", "|AR", "|$C:1", "|Bf:35,1024|FS:0,0|SP1:0,,|SP2:100,,|AR|$C:1|H:1,7|WCS:G54"],
)
def test_keys_that_nobody_knows_are_no_damage(fields: str) -> None:
    with simulated_bench(before=Scripted) as bench, bench.stage as stage:
        scripted(bench).on_transmit = lambda data: data.replace(b">", fields.encode() + b">")
        stage.home()
        assert stage.move_to(150.0, TIMEOUT_S) == pytest.approx(150.0)
