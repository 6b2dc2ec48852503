"""The simulated Marlin at its borders: lines, settings, feeds, limits."""

import pytest
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.marlin import MarlinFirmware
from rig_sim.firmware.marlin.lines import Damaged, Taken, check_line
from rig_sim.firmware.marlin.settings import MarlinSettings

from rig.profile import CarriageConfig, FirmwareConfig, MarlinFirmwareConfig

FIRMWARE = FirmwareConfig(
    axis="Y",
    travel_mm=120.0,
    max_rate_mm_s=100.0,
    acceleration_mm_s2=500.0,
    steps_per_mm=160.0,
    homing_mm_s=50.0,
    homing_locate_mm_s=20.0,
    boot_s=1.0,
)


class Console:
    """A controller whose Y axis carries the board, 40 mm away from its switch."""

    def __init__(self, *, has_switch: bool = True, **marlin: object) -> None:
        self.clock = VirtualClock(10.0)
        mechanics = CarriageConfig(
            board_at_machine_zero_mm=210.0, power_up_mm=-40.0, has_switch=has_switch
        )
        self.carriage = Carriage(mechanics, self.clock)
        more = MarlinFirmwareConfig.model_validate(marlin)
        config = FIRMWARE.model_copy(update={"marlin": more})
        self.firmware = MarlinFirmware(config, self.carriage, self.clock)
        self.banner = self.wait(1.1)

    def say(self, *lines: str) -> list[str]:
        self.firmware.receive("".join(line + "\n" for line in lines).encode())
        return self.wait(0.0)

    def wait(self, duration_s: float = 20.0) -> list[str]:
        self.clock.sleep_s(duration_s)
        return self.firmware.transmit().decode().splitlines()

    def true_mm(self) -> float:
        return self.carriage.travelled_mm(self.clock.now_s())

    def position(self) -> str:
        return self.say("M114")[0].partition(" E:")[0]


@pytest.fixture
def homed() -> Console:
    console = Console()
    console.say("G28")
    console.wait()
    assert console.true_mm() == pytest.approx(0.0, abs=0.01)
    return console


TOLD = [
    "echo:; Linear Units:",
    "echo:  G21 ; (mm)",
    "echo:; Steps per unit:",
    "echo:  M92 X80.00 Y160.00 Z80.00 E500.00",
    "echo:; Max feedrates (units/s):",
    "echo:  M203 X300.00 Y100.00 Z300.00 E25.00",
    "echo:; Max Acceleration (units/s2):",
    "echo:  M201 X3000.00 Y500.00 Z3000.00 E10000.00",
    "echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):",
    "echo:  M204 P500.00 R3000.00 T500.00",
    "echo:; Home offset:",
    "echo:  M206 X0.00 Y0.00 Z0.00",
]
ENDS = "echo:  Min:  X0.00 Y0.00 Z0.00   Max:  X200.00 Y120.00 Z200.00"


def test_settings_are_told_by_axis():
    settings = MarlinSettings.of(FIRMWARE)
    assert settings.lines() == TOLD
    assert settings.soft_stop_lines() == ["echo:  M211 S1 ; ON", ENDS]
    without = MarlinSettings.of(FIRMWARE.model_copy(update={"soft_limits": False}))
    assert without.soft_stop_lines() == ["echo:  M211 S0 ; OFF", ENDS]
    assert [settings.max_rate_mm_s(axis) for axis in range(3)] == [300.0, 100.0, 300.0]
    assert [settings.acceleration_mm_s2(axis) for axis in range(3)] == [500.0, 500.0, 500.0]
    assert [settings.steps_per_mm(axis) for axis in range(3)] == [80.0, 160.0, 80.0]


def test_the_start_and_two_questions_tell_them():
    console = Console()
    assert console.banner[0] == "start"
    assert console.banner[-14:] == [*TOLD, "echo:  M211 S1 ; ON", ENDS]
    assert console.say("M503") == [*TOLD, "ok"]
    assert console.say("M211") == ["echo:  M211 S1 ; ON", ENDS, "ok"]
    assert console.say("M105") == ["T:21.00 /0.00 B:21.00 /0.00 @:0 B@:0", "ok"]


@pytest.mark.parametrize(
    ("command", "line"),
    [
        ("M92 X100 Z50.5", "echo:  M92 X100.00 Y160.00 Z50.50 E500.00"),
        ("M203 Y12", "echo:  M203 X300.00 Y12.00 Z300.00 E25.00"),
        ("M201 Y90", "echo:  M201 X3000.00 Y90.00 Z3000.00 E10000.00"),
        ("M204 T75", "echo:  M204 P75.00 R3000.00 T75.00"),
        ("M204 P75", "echo:  M204 P500.00 R3000.00 T500.00"),
    ],
)
def test_settings_last_until_the_next_start(command: str, line: str):
    console = Console()
    assert console.say(command) == ["ok"]
    assert line in console.say("M503")
    console.firmware.hard_reset()
    console.wait(1.1)
    assert console.say("M503") == [*TOLD, "ok"]


@pytest.mark.parametrize("command", ["G21", "M110", "M17", "M108", "M999", "M113 S5", "M220 S50"])
def test_what_changes_nothing_here_is_taken(command: str):
    assert Console().say(command) == ["ok"]


def test_places_are_absolute_or_further_on(homed: Console):
    homed.say("G1 Y20 X3 F6000")
    assert homed.position() == "X:3.00 Y:20.00 Z:0.00"
    homed.say("G91", "G1 Y5 Z-2")
    assert homed.position() == "X:3.00 Y:25.00 Z:0.00"
    homed.say("G90", "G0 Y7")
    assert homed.position() == "X:3.00 Y:7.00 Z:0.00"
    homed.wait()
    assert homed.true_mm() == pytest.approx(-7.0, abs=0.01)
    assert homed.say("M114")[0].endswith("E:0.00 Count X:240 Y:1120 Z:0")


@pytest.mark.parametrize(
    ("asked", "planned"), [("120", "120.00"), ("120.01", "120.00"), ("0", "0.00"), ("-1", "0.00")]
)
def test_a_homed_axis_stays_within_its_ends(homed: Console, asked: str, planned: str):
    homed.say("G1 Y50", f"G1 Y{asked}")
    assert homed.position() == f"X:0.00 Y:{planned} Z:0.00"


def test_an_axis_that_is_not_homed_goes_anywhere():
    console = Console()
    console.say("G1 X-5 Y-3 F6000")
    assert console.position() == "X:-5.00 Y:-3.00 Z:0.00"
    console.say("G28 X")
    console.wait()
    assert console.position() == "X:0.00 Y:-3.00 Z:0.00"
    console.say("G1 X-5 Y-4")
    assert console.position() == "X:0.00 Y:-4.00 Z:0.00"
    console.say("M84")
    console.wait()
    console.say("G1 X-5")
    assert console.position() == "X:-5.00 Y:-4.00 Z:0.00"


@pytest.mark.parametrize(
    ("before", "line", "took_s"),
    [
        # Without a feed it is 25 mm/s; at 500 mm/s2 each ramp is v / a long.
        ("G90", "G1 Y25", 1.05),
        ("G90", "G1 Y50 F3000", 1.1),
        ("G90", "G1 Y50 F60000", 0.7),
        ("M220 S50", "G1 Y25 F3000", 1.05),
        ("M220 S50", "G1 Y50 F60000", 0.7),
        ("M203 Y50", "G1 Y50 F60000", 1.1),
        ("M204 T125", "G1 Y50 F3000", 1.4),
        ("M201 Y125", "G1 Y50 F3000", 1.4),
    ],
)
def test_a_move_takes_its_time(homed: Console, before: str, line: str, took_s: float):
    homed.say(before)
    assert homed.say(line, "M400") == ["ok"]
    assert homed.wait(took_s - 0.01) == []
    assert homed.wait(0.02) == ["ok"]


@pytest.mark.parametrize(("words", "dwell_s"), [("P500", 0.5), ("S2", 2.0), ("P250 S1", 1.25)])
def test_a_dwell_takes_its_time(homed: Console, words: str, dwell_s: float):
    assert homed.say(f"G4 {words}") == []
    assert homed.wait(dwell_s - 0.001) == []
    assert homed.wait(0.002) == ["ok"]


def test_homing_tells_where_it_ends():
    console = Console()
    console.say("G1 Z5 X6")
    console.wait()
    console.say("G28 Y")
    assert console.wait() == ["X:6.00 Y:0.00 Z:5.00 E:0.00 Count X:0 Y:0 Z:0", "ok"]


def test_homing_gives_up_after_one_and_a_half_travels():
    console = Console(has_switch=False)
    console.say("G28 Y")
    console.wait()
    assert console.true_mm() == pytest.approx(-40.0 + 1.5 * 120.0, abs=0.01)


def test_fifteen_moves_are_planned_and_the_next_waits():
    console = Console(advanced_ok=True)
    answers = [console.say(f"G1 X{number} F60") for number in range(1, 17)]
    assert answers == [["ok"]] * 15 + [[]]
    assert console.wait(0.99) == []
    assert "ok" in console.wait(0.2)
    told = console.say(with_check("N1 M105"))
    assert told[-1] == "ok N1 P0 B4"


def with_check(body: str) -> str:
    """A numbered line with the sum of its bytes, each bit for itself."""
    check = 0
    for byte in body.encode():
        check ^= byte
    return f"{body}*{check}"


@pytest.mark.parametrize(
    ("line", "last", "found"),
    [
        (with_check("N8 M114"), 7, Taken("M114", 8)),
        ("  " + with_check("N8 M114"), 7, Taken("M114", 8)),
        (with_check("N8 M114") + " ", 7, Taken("M114", 8)),
        (with_check("N M114"), -1, Taken("M114", 0)),
        (with_check("N5 M110"), 77, Taken("M110", 5)),
        (with_check("N5 M110 N9"), 77, Taken("M110 N9", 9)),
        (with_check("N5"), 4, Taken("M110", 5)),
        (with_check("N8 M118 \xe9"), 7, Damaged("checksum mismatch")),
        (with_check("N8 M114"), 8, Damaged("Line Number is not Last Line Number+1")),
        (with_check("N8 M114"), 6, Damaged("Line Number is not Last Line Number+1")),
        ("N8 M114*37", 7, Damaged("checksum mismatch")),
        ("N8 M114*", 7, Damaged("checksum mismatch")),
        ("N8 M114", 7, Damaged("No Checksum with line number")),
        ("M114*12", 7, Damaged("No Line Number with checksum")),
        (" M114 ", 7, Taken("M114", None)),
    ],
)
def test_a_line_is_taken_by_its_number_and_its_check(line: str, last: int, found: Taken | Damaged):
    assert check_line(line, last) == found


def test_a_line_keeps_its_first_ninety_five_characters():
    console = Console()
    assert console.say("M118 " + "a" * 89 + "b" + "c" * 9) == ["a" * 89 + "b", "ok"]


def test_with_the_emergency_parser_an_urgent_command_overtakes_the_queue():
    for is_on, told in ((True, "1"), (False, "0")):
        console = Console(emergency_parser=is_on)
        assert f"Cap:EMERGENCY_PARSER:{told}" in console.say("M115")
        console.say("G4 S5", "G4 S5", "G4 S5", "G4 S5", "G4 S5")
        assert console.say("M112") == (["Error:Printer halted. kill() called!"] if is_on else [])
