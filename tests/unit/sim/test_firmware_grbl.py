"""The simulated GRBL, byte by byte: what GRBL 1.1h says, and when."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.grbl import GrblFirmware

from rig.profile import CarriageConfig, FirmwareConfig

BANNER = ["Grbl 1.1h ['$' for help]", "[MSG:'$H'|'$X' to unlock]"]
HOME_S = 12.0


class Console:
    """A person at a terminal with a clock."""

    def __init__(self, carriage: CarriageConfig | None = None, **firmware: object) -> None:
        self.clock = VirtualClock()
        mechanics = CarriageConfig(board_at_machine_zero_mm=500.0, power_up_mm=-50.0)
        self.carriage = Carriage(carriage or mechanics, self.clock)
        settings = FirmwareConfig.model_validate({"travel_mm": 200.0, **firmware})
        self.firmware = GrblFirmware(settings, self.carriage, self.clock)

    def say(self, text: str | bytes, wait_s: float = 0.1) -> list[str]:
        """Type, wait, and return what was printed."""
        self.firmware.receive(text.encode() if isinstance(text, str) else text)
        self.clock.sleep_s(wait_s)
        return [line for line in self.firmware.transmit().decode().split("\r\n") if line]

    def status(self) -> str:
        (line,) = self.say("?", 0.0)
        return line

    def position_mm(self) -> float:
        fields = dict(field.split(":", 1) for field in self.status()[1:-1].split("|")[1:])
        return float(fields["MPos"].split(",")[0])


@pytest.fixture
def locked() -> Console:
    """A controller after power-up."""
    console = Console()
    console.say("", 2.0)
    return console


@pytest.fixture
def homed(locked: Console) -> Console:
    assert locked.say("$H\n", HOME_S) == ["ok"]
    return locked


def test_power_up_takes_its_time_and_locks() -> None:
    console = Console(boot_s=1.6)
    assert console.say("?$I\n", 1.5) == [], "the boot loader eats what comes early"
    assert console.say("", 0.2) == BANNER
    assert console.status().startswith("<Alarm|MPos:0.000,0.000,0.000|FS:0,0")


def test_without_homing_there_is_no_lock() -> None:
    console = Console(homing=False)
    assert console.say("", 2.0) == BANNER[:1]
    assert console.status().startswith("<Idle|")
    assert console.say("$H\n") == ["error:5"]
    assert console.say("$20=1\n") == ["error:10"]


def test_a_locked_controller_takes_settings_but_no_motion(locked: Console) -> None:
    assert locked.say("G0X-1\n") == ["error:9"]
    assert locked.say("$J=X-1F100\n") == ["error:8"]
    assert locked.say("$I\n") == ["[VER:1.1h.20190830:]", "[OPT:V,15,128]", "ok"]
    assert locked.say("$X\n") == ["[MSG:Caution: Unlocked]", "ok"]
    assert locked.say("G0X-1\n") == ["ok"]


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G1 X", "error:2"),
        ("5X", "error:1"),
        ("$Q", "error:2"),
        ("$200=1", "error:3"),
        ("$100", "error:3"),
        ("$100=a", "error:2"),
        ("$130=-5", "error:4"),
        ("$130=nan", "error:2"),
        ("$130=1e3", "error:2"),
        ("$100=0", "error:4"),
        ("$0=1", "error:6"),
        ("G1 X-1", "error:22"),
        ("G2 X-1 R5", "error:20"),
        ("M3", "error:20"),
        ("G1.5 X-1", "error:23"),
        ("G0 G1 X-1", "error:21"),
        ("G92 G1 X-1", "error:24"),
        ("G0 X-1 X-2", "error:25"),
        ("G92", "error:26"),
        ("G4", "error:28"),
        ("G80 G53 X-1", "error:30"),
        ("G80 X-1", "error:31"),
        ("G1 F100 P1", "error:36"),
        ("F-1", "error:4"),
        ("$J=X-1", "error:22"),
        ("$J=G4P1F1", "error:16"),
        ("$J=X5F100", "error:15"),
        ("$JX5F100", "error:3"),
        ("G1 X-" + "1" * 80, "error:11"),
        ("F1" + "0" * 78, "error:11"),
        ("F1" + "0" * 77, "ok"),
        ("", "ok"),
        ("(a comment) ; another", "ok"),
        ("g0 x -1.5 (there) ; quickly", "ok"),
        ("$", "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]"),
        ("$#", "[G54:0.000,0.000,0.000]"),
        ("$N", "$N0="),
        ("$G", "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]"),
    ],
)
def test_answers_are_those_of_grbl(homed: Console, line: str, answer: str) -> None:
    assert homed.say(line + "\n")[0] == answer


def test_homing_is_silent_until_it_is_done(locked: Console) -> None:
    assert locked.say("$H\n???", 1.0) == []
    lines = locked.say("", HOME_S)
    assert len(lines) == 2, "many questions, one answer"
    assert lines[0].startswith("<Home|MPos:-2.000,")
    assert lines[1] == "ok"
    assert locked.status().startswith("<Idle|MPos:-2.000,0.000,0.000|")
    assert locked.carriage.travelled_mm(locked.clock.now_s()) == pytest.approx(-2.0, abs=0.003)


def test_homing_without_a_switch_fails() -> None:
    mechanics = CarriageConfig(board_at_machine_zero_mm=500.0, power_up_mm=-50.0, has_switch=False)
    console = Console(mechanics)
    console.say("", 2.0)
    assert console.say("$H\n", HOME_S) == ["ALARM:9", "ok", *BANNER]


def test_homing_in_the_wrong_direction_finds_no_switch(locked: Console) -> None:
    locked.say("$23=1\n")
    assert locked.say("$H\n", HOME_S) == ["ALARM:9", "ok", *BANNER]
    true_mm = locked.carriage.travelled_mm(locked.clock.now_s())
    assert true_mm == pytest.approx(-50.0 - 1.5 * 200.0, abs=0.01)


def test_homing_fails_if_the_switch_stays_closed() -> None:
    mechanics = CarriageConfig(board_at_machine_zero_mm=500.0, power_up_mm=-50.0, backlash_mm=3.0)
    console = Console(mechanics)
    console.say("", 2.0)
    assert console.say("$H\n", HOME_S) == ["ALARM:8", "ok", *BANNER]


def test_a_reset_breaks_homing_off(locked: Console) -> None:
    locked.say("$H\n", 0.3)
    assert locked.say(b"\x18", 1.0) == ["ALARM:6", "ok", *BANNER]


def test_ok_means_queued_not_done(homed: Console) -> None:
    assert homed.say("G1X-52F3000\n", 0.0) == ["ok"]
    assert homed.say("G4P0.01\n", 0.5) == [], "a dwell waits for the motion"
    assert homed.status().startswith("<Run|")
    assert homed.say("", 1.0) == ["ok"]
    assert homed.position_mm() == -52.0


def test_motion_accelerates(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.1)
    assert homed.position_mm() == pytest.approx(-2.0 - 0.5 * 400.0 * 0.1**2, abs=0.003)
    homed.say("", 1.0 + 0.25 - 0.1 - 1e-6)
    assert homed.status().startswith("<Run|")
    homed.say("", 1e-3)
    assert homed.status().startswith("<Idle|MPos:-102.000")


def test_the_board_follows_the_report(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.4)
    reported_mm = homed.position_mm()
    assert homed.carriage.travelled_mm(homed.clock.now_s()) == pytest.approx(reported_mm, abs=0.003)


def test_a_full_planner_holds_back_the_answer(homed: Console) -> None:
    lines = [f"G1X{-3 - index % 2}F60\n" for index in range(17)]
    assert [homed.say(line, 0.0) for line in lines] == [["ok"]] * 15 + [[], []]
    assert homed.say("", 60.0) == ["ok", "ok"]
    assert homed.status().startswith("<Idle|MPos:-3.000")


def test_the_receive_buffer_overflows_silently(homed: Console) -> None:
    homed.say("G4P5\n", 0.0)
    homed.say("G4P0.1\n" * 40, 0.0)
    assert homed.say("", 60.0) == ["ok"] * (1 + 128 // len("G4P0.1\n"))


def test_a_jog_is_refused_beyond_the_travel_without_an_alarm(homed: Console) -> None:
    assert homed.say("$J=X-201F1000\n") == ["error:15"]
    assert homed.status().startswith("<Idle|MPos:-2.000")


def test_gcode_is_locked_out_while_jogging(homed: Console) -> None:
    assert homed.say("$J=X-52F1000\n") == ["ok"]
    assert homed.status().startswith("<Jog|")
    assert homed.say("G4P0\n") == ["error:9"]
    assert homed.say("$J=G91X-1F1000\n", 5.0) == ["ok"]
    assert homed.position_mm() == -53.0


@pytest.mark.parametrize("command", [b"!", b"\x85"])
def test_a_jog_is_cancelled_for_good(homed: Console, command: bytes) -> None:
    homed.say("$J=X-102F6000\n$J=X-2F6000\n", 0.5)
    homed.say(command, 1.0)
    stopped = homed.status()
    assert stopped.startswith("<Idle|")
    homed.say("~", 1.0)
    assert homed.status()[:20] == stopped[:20], "the second jog is gone as well"
    assert homed.carriage.travelled_mm(homed.clock.now_s()) == pytest.approx(
        homed.position_mm(), abs=0.003
    )


def test_a_hold_brakes_and_a_start_resumes(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.5)
    homed.say("!", 0.05)
    assert homed.status().startswith("<Hold:1|")
    homed.say("", 1.0)
    held = homed.status()
    assert held.startswith("<Hold:0|")
    homed.say("", 5.0)
    assert homed.position_mm() == float(held.split(":")[2].split(",")[0])
    homed.say("~", 2.0)
    assert homed.status().startswith("<Idle|MPos:-102.000")


def test_a_reset_at_rest_after_a_hold_keeps_the_position(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.5)
    homed.say("!", 1.0)
    held_mm = homed.position_mm()
    assert homed.say(b"\x18", 1.0) == BANNER[:1]
    assert homed.status().startswith("<Idle|")
    assert homed.position_mm() == held_mm
    assert homed.carriage.travelled_mm(homed.clock.now_s()) == pytest.approx(held_mm, abs=0.003)


def test_a_reset_in_motion_loses_the_position(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.5)
    assert homed.say(b"\x18", 0.1) == ["ALARM:3"]
    assert homed.say("", 1.0) == BANNER
    assert homed.say("G0X-5\n") == ["error:9"]
    true_mm = homed.carriage.travelled_mm(homed.clock.now_s())
    assert abs(true_mm - homed.position_mm()) > 0.5


def test_a_hold_at_rest_waits_for_a_start(homed: Console) -> None:
    homed.say("!")
    assert homed.status().startswith("<Hold:0|")
    assert homed.say("G0X-5\n") == [], "lines wait"
    assert homed.say("~", 1.0) == ["ok"]
    assert homed.position_mm() == -5.0


def test_a_soft_limit_locks_up_until_a_reset(homed: Console) -> None:
    assert homed.say("G0X1\n", 1.0) == ["ALARM:2", "[MSG:Reset to continue]"]
    assert homed.say("?$X\n$H\n", 5.0) == [], "everything is ignored"
    assert homed.say(b"\x18", 1.0) == ["ok", *BANNER]
    assert homed.status().startswith("<Alarm|MPos:-2.000"), "the position is kept"


def test_a_soft_limit_in_motion_stops_gently_first(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.5)
    assert homed.say("G0X1\n", 2.0) == ["ALARM:2", "[MSG:Reset to continue]"]
    homed.say(b"\x18", 1.0)
    true_mm = homed.carriage.travelled_mm(homed.clock.now_s())
    assert homed.position_mm() == pytest.approx(true_mm, abs=0.003)


def test_the_switch_stops_everything_where_it_is_a_hard_limit() -> None:
    console = Console(soft_limits=False, hard_limits=True)
    console.say("", 2.0)
    console.say("$H\n", HOME_S)
    assert console.say("G1X10F1000\n", 2.0) == ["ok", "ALARM:1", "[MSG:Reset to continue]"]
    assert console.say("?", 1.0) == []
    assert console.say(b"\x18", 1.0)[-2:] == BANNER


def test_opening_the_port_in_motion_loses_everything(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.5)
    homed.firmware.hard_reset()
    assert homed.say("", 2.0) == BANNER
    assert homed.position_mm() == 0.0
    assert homed.carriage.travelled_mm(homed.clock.now_s()) < -30.0


def test_offset_and_overrides_come_now_and_then(homed: Console) -> None:
    fields = [homed.status() for _ in range(20)]
    assert sum("|WCO:" in line for line in fields) == 2
    assert sum("|Ov:100,100,100" in line for line in fields) == 2
    homed.say("G92X0\n")
    assert "|WCO:-2.000,0.000,0.000" in homed.status(), "a change is told at once"


def test_reports_are_as_the_settings_want_them(homed: Console) -> None:
    homed.say("$10=2\n")
    homed.say("G92X0\n")
    assert homed.status().startswith("<Idle|WPos:0.000,0.000,0.000|Bf:15,128|FS:0,0")
    homed.say("$13=1\n")
    homed.say("G20G0X-1\n", 5.0)
    assert homed.status().startswith("<Idle|WPos:-1.0000,")


def test_work_coordinates_inches_and_increments(homed: Console) -> None:
    homed.say("G92X10\nG0X5\n", 1.0)
    assert homed.position_mm() == -7.0
    homed.say("G91G20G0X-1\n", 3.0)
    assert homed.position_mm() == -32.4
    homed.say("G53G21G90G0X-20\n", 3.0)
    assert homed.position_mm() == -20.0


def test_other_axes_count_but_turn_no_motor(homed: Console) -> None:
    before_mm = homed.carriage.travelled_mm(homed.clock.now_s())
    homed.say("G1Y-5F6000\n", 5.0)
    assert homed.status().startswith("<Idle|MPos:-2.000,-5.000,0.000")
    assert homed.carriage.travelled_mm(homed.clock.now_s()) == before_mm
    homed.say("G1X-5Y-9F6000\n", 5.0)
    assert homed.carriage.travelled_mm(homed.clock.now_s()) == pytest.approx(-5.0, abs=0.003)


def test_settings_survive_every_reset(homed: Console) -> None:
    assert homed.say("$110=1200\n") == ["ok"]
    homed.say(b"\x18", 1.0)
    assert "$110=1200.000" in homed.say("$$\n")
    homed.firmware.hard_reset()
    homed.say("", 2.0)
    assert "$110=1200.000" in homed.say("$$\n")


def test_settings_are_not_read_in_motion(homed: Console) -> None:
    homed.say("G1X-102F6000\n", 0.5)
    assert homed.say("$$\n", 0.0) == ["error:8"]
    assert homed.say("$H\n", 0.0) == ["error:8"]


def test_the_next_event_can_be_jumped_to(homed: Console) -> None:
    assert homed.firmware.next_event_s() is None
    homed.say("G1X-102F6000\n", 0.0)
    end_s = homed.firmware.next_event_s()
    assert end_s == pytest.approx(homed.clock.now_s() + 1.25)
    homed.clock.sleep_s(2.0)
    assert homed.firmware.next_event_s() is None


WORDS = [
    "$J=",
    "$H",
    "$X",
    "$$",
    "G53",
    "G91",
    "G1",
    "G4",
    "G92",
    "X-5",
    "X1",
    "Y2",
    "F900",
    "P.2",
    "$130=",
    "$27=0",
    "9",
    "-",
    ".",
]
TYPED = st.lists(
    st.one_of(
        st.sampled_from(
            [b"?", b"!", b"~", b"\x18", b"\x85", b"\n", b"\n", *(w.encode() for w in WORDS)]
        ),
        st.binary(max_size=5),
    ),
    max_size=30,
)


@pytest.mark.slow
@given(typed=TYPED, pause_s=st.sampled_from([0.0, 0.07, 1.0]), is_homed=st.booleans())
def test_nothing_that_is_typed_breaks_it(
    typed: list[bytes], pause_s: float, is_homed: bool
) -> None:
    console = Console(boot_s=0.1)
    console.say("", 0.2)
    if is_homed:
        console.say("$H\n", HOME_S)
    for data in typed:
        console.say(data, pause_s)
    console.say(b"\n~\x18", 2.0)
    console.say(b"\x18", 2.0)
    answer = console.status()
    assert answer.startswith(("<Idle|", "<Alarm|")), typed
