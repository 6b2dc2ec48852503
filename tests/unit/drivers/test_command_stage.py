"""A stage behind a program: its answers, real processes, and what is refused."""

import json
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.command.answer import Answer, NoAnswerError, read_answer
from rig_drivers.command.program import CommandProgram
from rig_drivers.command.stage import CommandStage

from rig.devices import SystemClock
from rig.errors import (
    ConfigError,
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StageLimitError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import CommandStageConfig
from tests.support.programs import command_bench

# -- answers --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("output", "answer"),
    [
        ('{"position_mm": 400}\n', Answer(position_mm=400.0)),
        ('\n{"position_mm": -0.25}\r\n\n', Answer(position_mm=-0.25)),
        ('{"position_mm": null}', Answer()),
        ('{"stopped": true}', Answer(is_stopped=True)),
        ('{"error": "no power"}', Answer(error="no power")),
    ],
)
def test_one_line_of_json_is_an_answer(output: str, answer: Answer) -> None:
    assert read_answer(output) == answer


@pytest.mark.parametrize(
    ("output", "told"),
    [
        ("", "0 lines"),
        ('{"position_mm": 1}\n{"position_mm": 2}\n', "2 lines"),
        ("400.0 mm", "no JSON"),
        pytest.param("[" * 9_000, "no JSON", id="deep"),
        ("400.0", "'400.0'"),
        ('{"stopped": false}', "stopped"),
        ('{"stopped": 1}', "stopped"),
        ('{"position_mm": "400"}', "400"),
        ('{"position_mm": true}', "True"),
        ('{"position_mm": NaN}', "nan"),
        ('{"position_mm": 1e7}', "10000000"),
        ('{"position_mm": 1, "unit": "inch"}', "inch"),
        pytest.param("x" * 10_001, "10001 characters", id="too long"),
    ],
)
def test_anything_else_is_told(output: str, told: str) -> None:
    with pytest.raises(NoAnswerError) as caught:
        read_answer(output)
    assert told in str(caught.value)


@given(st.text(max_size=200) | st.from_regex(r'\{"position_mm": [-0-9a-z.]{1,9}\}', fullmatch=True))
def test_any_text_is_an_answer_or_told(text: str) -> None:
    try:
        answer = read_answer(text)
    except NoAnswerError as error:
        assert str(error)
    else:
        assert isinstance(answer, Answer)


# -- behaviour ------------------------------------------------------------------------------------


def test_every_call_has_its_subcommand_last() -> None:
    with command_bench() as (stage, program, _), stage:
        stage.home()
        stage.move_to(450.0, 60.0)
    opening, homing = [("stop",), ("position",)], [("position",)]
    moving = [("position",), ("move", "450.0000"), ("position",)]
    assert program.asked == [*opening, *homing, *moving, ("stop",)]


def test_going_nearer_passes_the_place_and_comes_back() -> None:
    with command_bench(approach_mm=2.0) as (stage, program, _), stage:
        stage.home()
        stage.move_to(500.0, 60.0)
        program.asked.clear()
        stage.move_to(450.0, 60.0)
        assert [a for a in program.asked if a[0] == "move"] == [
            ("move", "448.0000"),
            ("move", "450.0000"),
        ]
        program.asked.clear()
        stage.move_to(480.0, 60.0)
        assert [a for a in program.asked if a[0] == "move"] == [("move", "480.0000")]


@pytest.mark.parametrize(
    "answer", ['{"error": "unknown word stop"}', "usage: stage move|position", "", '{"stopped": 0}']
)
def test_a_program_that_cannot_stop_is_refused(answer: str) -> None:
    with command_bench() as (stage, program, _):
        program.says["stop"] = answer
        with pytest.raises(ConfigError, match=r"cannot be stopped is refused.*command-stage\.md"):
            stage.__enter__()
        assert ("position",) not in program.asked


def test_a_stop_that_hangs_is_refused() -> None:
    with command_bench() as (stage, program, _):
        program.hangs.add("stop")
        with pytest.raises(ConfigError, match=r"`stop` within 5\.0 s"):
            stage.__enter__()
        assert program.killed == 1


def test_a_place_outside_is_refused_and_nothing_runs() -> None:
    with command_bench() as (stage, program, _), stage:
        stage.home()
        program.asked.clear()
        with pytest.raises(StageLimitError):
            stage.move_to(399.0, 60.0)
        assert program.asked == []


def test_a_stage_that_ends_elsewhere_is_told() -> None:
    with command_bench() as (stage, program, _), stage:
        stage.home()
        program.short_mm = 0.06
        with pytest.raises(StagePositionError, match=r"reads 449\.940"):
            stage.move_to(450.0, 60.0)
        program.short_mm = 0.04
        assert stage.move_to(460.0, 60.0) == pytest.approx(459.96)


def test_a_move_that_hangs_is_ended_and_stopped() -> None:
    with command_bench() as (stage, program, clock), stage:
        stage.home()
        program.hangs.add("move")
        program.asked.clear()
        start_s = clock.now_s()
        with pytest.raises(StageTimeoutError, match=r"450\.000 mm within 3\.0 s") as caught:
            stage.move_to(450.0, 3.0)
        assert caught.value.timeout_s == pytest.approx(3.0)
        assert clock.now_s() - start_s == pytest.approx(3.0, abs=0.2)
        assert program.killed == 1
        assert program.asked[-1] == ("stop",)


def test_what_the_program_says_of_an_error_is_told_and_the_stage_stopped() -> None:
    with command_bench() as (stage, program, _), stage:
        stage.home()
        program.says["move"] = '{"error": "belt torn"}'
        program.asked.clear()
        with pytest.raises(StageAlarmError, match="says of `move`: belt torn") as caught:
            stage.move_to(450.0, 60.0)
        assert caught.value.code == "error"
        assert program.asked[-1] == ("stop",)


def test_a_stop_that_fails_in_a_move_is_told_as_danger() -> None:
    with command_bench() as (stage, program, _):
        stage.__enter__()
        stage.home()
        program.says["move"] = '{"error": "belt torn"}'
        program.says["stop"] = '{"error": "no answer"}'
        with pytest.raises(DeviceLostError, match=r"could not be stopped.*switch its supply off"):
            stage.move_to(450.0, 60.0)


def test_a_program_that_loses_its_place_wants_homing() -> None:
    with command_bench() as (stage, program, _), stage:
        stage.home()
        program.says["position"] = '{"position_mm": null}'
        for _ in range(2):
            with pytest.raises(StageAlarmError, match="home") as caught:
                _ = stage.position_mm
            assert caught.value.code == "not homed"


def test_moving_may_be_forbidden() -> None:
    with command_bench(may_move=False) as (stage, program, _), stage:
        for move in (stage.home, lambda: stage.move_to(450.0, 1.0)):
            with pytest.raises(ConfigError, match="may_move is false"):
                move()
        assert all(asked[0] != "move" for asked in program.asked)


# -- processes ------------------------------------------------------------------------------------

SCRIPT = """\
import json, pathlib, sys
place = pathlib.Path(__file__).with_suffix(".mm")
word, *rest = sys.argv[1:]
if word == "move":
    place.write_text(rest[0])
if word == "stop":
    print(json.dumps({"stopped": True}))
elif word == "fail":
    sys.exit("something broke")
else:
    print(json.dumps({"position_mm": float(place.read_text()) if place.exists() else 400.0}))
"""


def stage_of(*command: str, **changes: object) -> CommandStage:
    config = CommandStageConfig.model_validate(
        {"kind": "command", "command": command, "travel_mm": (400.0, 900.0), **changes}
    )
    return CommandStage(config, SystemClock(), CommandProgram(config.command, "stage"))


def test_a_real_program_moves_reads_and_stops(tmp_path: Path) -> None:
    script = tmp_path / "stage $(touch x); it's.py"  # a shell would stumble over this name
    script.write_text(SCRIPT)
    with stage_of(sys.executable, "-S", str(script), answer_timeout_s=60.0) as stage:
        stage.home()
        assert stage.move_to(512.25, 60.0) == 512.25
        assert stage.position_mm == 512.25
    assert not (tmp_path / "x").exists()
    assert json.loads(script.with_suffix(".mm").read_text()) == 512.25


def test_a_program_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(DeviceNotFoundError, match=r"cannot run '.*nothing'.*check stage\.command"):
        stage_of(str(tmp_path / "nothing")).__enter__()


def test_exit_code_and_complaint_are_told() -> None:
    broken = (sys.executable, "-S", "-c", "import sys; sys.exit('something broke')")
    with pytest.raises(ConfigError, match="exit code 1, 'something broke'"):
        stage_of(*broken, answer_timeout_s=60.0).__enter__()


def test_a_process_that_hangs_is_killed_with_its_children() -> None:
    running = CommandProgram((sys.executable, "-S", "-c"), "stage").start(
        ("import subprocess, sys; subprocess.run([sys.executable, '-S', '-c', 'input()'])",)
    )
    assert running.output(0.0) is None
    running.kill()
    done = running.output(60.0)
    assert done is not None
    assert done[0] == -9


def test_the_example_of_the_page_is_a_stage_in_twenty_lines(tmp_path: Path) -> None:
    page = Path(__file__).parents[3] / "docs/how-to/command-stage.md"
    example = page.read_text().partition("```python\n")[2].partition("```")[0]
    assert sum(bool(line.strip()) for line in example.splitlines()) <= 20
    script = tmp_path / "stage.py"
    script.write_text(example)
    with stage_of(sys.executable, "-S", str(script), answer_timeout_s=60.0) as stage:
        with pytest.raises(StageAlarmError, match="let the program find its reference"):
            stage.home()
        script.with_suffix(".position").write_text("400")
        stage.home()
        assert stage.move_to(512.25, 60.0) == 512.25
