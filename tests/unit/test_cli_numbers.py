"""Numbers as verbs tell them: tables, angles, time left, and what a sweep comes to."""

import math
import sys
from types import SimpleNamespace
from typing import Any

import pytest
import typer

from rig.cli.options import finite
from rig.cli.output import show_json, table
from rig.cli.progress import ProgressLine
from rig.cli.sweep_result import (
    alignment_as_dict,
    alignment_lines,
    result_as_dict,
    result_lines,
    use_as_dict,
    use_lines,
)
from rig.cli.words import profile_names
from rig.curve import DepthError, Headline
from rig.sweep.alignment import Alignment, Angles
from rig.sweep.take import SweepTimes
from tests.support.command import Command

SQUARE = Angles(0.0, 0.0, (0.01, 0.01))

GOOD = Headline((400.0, 1200.0), (DepthError(1000.0, 0.1),), 3, (DepthError(1000.0, 1.8),))


# --- output


def test_columns_of_numbers_stand_at_the_right():
    lines = table(
        [["a", "1.5", "-3", "", "1.2.3"], ["long", "10", "+22", "7", "x"]],
        ["name", "n", "signed", "some", "v"],
    )
    assert lines == [
        "name    n  signed  some  v",
        "a     1.5      -3        1.2.3",
        "long   10     +22     7  x",
    ]


def test_what_json_does_not_have_is_null(capsys: pytest.CaptureFixture[str]):
    show_json({"a": [1.5, math.nan, "é"], "b": {"c": math.inf, "d": None, 3: True}})
    assert capsys.readouterr().out == (
        '{\n  "a": [\n    1.5,\n    null,\n    "é"\n  ],\n  "b": {\n    "c": null,\n'
        '    "d": null,\n    "3": true\n  }\n}\n'
    )


# --- options


def test_lengths_are_finite():
    assert (finite(None), finite(0.0), finite(-2.5)) == (None, 0.0, -2.5)
    for value in (math.nan, math.inf, -math.inf):
        with pytest.raises(typer.BadParameter, match=f"{value} is no length"):
            finite(value)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("capture", "sim", "--set", "a..b=1"), "write it as key.path=value"),
        (("capture", "sim", "--set", "a.b"), "write it as key.path=value"),
        (("capture", "sim", "--calibration", "0"), "neither the number of a calibration nor none"),
        (
            ("capture", "sim", "--calibration", "two"),
            "neither the number of a calibration nor none",
        ),
        (("capture", "sim", "--db", "rig.sqlite"), "no URL"),
        (("capture", "sim", "--curve", "0"), "must be at least 1"),
    ],
)
def test_an_option_that_is_written_wrong_is_refused(
    rig: Command, arguments: tuple[str, ...], says: str
):
    answer = rig(*arguments)
    assert answer.code == 2
    assert says in " ".join(answer.err.replace("│", " ").split())


@pytest.mark.parametrize("number", ["1", "none"])
def test_the_number_of_a_calibration_may_be_one_or_none(rig: Command, number: str):
    assert rig("capture", "sim", "--calibration", number).code == 1  # there is none; well written


def test_profiles_are_offered_by_their_beginning():
    names = list(profile_names("si"))
    assert "sim" in names
    assert all(name.startswith("si") for name in names)


# --- progress


class Terminal:
    """A stream that says whether it is a terminal, and keeps what is written."""

    def __init__(self, *, is_terminal: bool) -> None:
        self.written = ""
        self._is_terminal = is_terminal

    def isatty(self) -> bool:
        return self._is_terminal

    def write(self, text: str) -> int:
        self.written += text
        return len(text)

    def flush(self) -> None:
        """Keep all as it is."""


def shown(
    monkeypatch: pytest.MonkeyPatch, reports: list[tuple[float, str]], *, is_terminal: bool,
    total: int | None = 9,
) -> str:  # fmt: skip
    stream = Terminal(is_terminal=is_terminal)
    monkeypatch.setattr(sys, "stderr", stream)
    times_s = iter([at_s for at_s, _ in reports])
    with ProgressLine(total, lambda: next(times_s)) as progress:
        for done, (_, text) in enumerate(reports, start=1):
            progress.report(done, text)
    return stream.written


def test_a_terminal_has_one_line_that_is_written_again(monkeypatch: pytest.MonkeyPatch):
    written = shown(monkeypatch, [(0.0, "long words"), (0.1, "a")], is_terminal=True, total=None)
    assert written == "\r[1] long words\r[2] a         \n"
    assert shown(monkeypatch, [], is_terminal=True) == ""


def test_a_file_has_a_line_every_two_seconds_and_the_last(monkeypatch: pytest.MonkeyPatch):
    reports = [(0.0, "a"), (1.9, "b"), (2.0, "c"), (3.0, "d")]
    written = shown(monkeypatch, reports, is_terminal=False, total=4)
    assert [line.split(",")[0] for line in written.splitlines()] == [
        "[1/4] a",
        "[3/4] c",
        "[4/4] d",
    ]
    endless = shown(monkeypatch, reports, is_terminal=False, total=None)
    assert endless.splitlines() == ["[1] a", "[3] c"]


def test_time_left_is_the_pace_of_the_later_half(monkeypatch: pytest.MonkeyPatch):
    """Three of nine done: from the second report to the third it took 40 s, six are left."""
    reports = [(0.0, "a"), (100.0, "b"), (140.0, "c")]
    written = shown(monkeypatch, reports, is_terminal=False)
    assert written.splitlines()[-1] == "[3/9] c, 4 min 0 s left"
    two = shown(monkeypatch, [(0.0, "a"), (25.0, "b")], is_terminal=False)
    assert two.splitlines()[-1] == "[2/9] b"  # the later half is one report


# --- sweep


def alignment(board: Angles | None, stage: Angles | None, *, calibrated: bool = True) -> Alignment:
    return Alignment(board, stage, calibrated)


def test_angles_are_told_with_their_side_and_twice_their_sigma():
    found = alignment(Angles(0.5, -0.25, (0.02, 0.03)), Angles(-0.5, 0.25, (0.02, 0.03)))
    assert alignment_lines(found) == [
        "board: right side 0.50 +- 0.04 deg farther and lower side 0.25 +- 0.06 deg nearer (k=2); "
        "turn it back by as much to stand square to the axis",
        "stage: moving away it goes 0.50 +- 0.04 deg left and 0.25 +- 0.06 deg below (k=2) of the "
        "optical axis; turn it back by as much to run along the axis",
    ]
    other = alignment_lines(alignment(None, Angles(0.5, -0.25, (0.02, 0.03)), calibrated=False))
    assert other[0].startswith("stage: moving away it goes 0.50 +- 0.04 deg right and 0.25 +- 0.06")
    assert " above (k=2) of the optical axis, if that passes the middle of the picture" in other[0]


@pytest.mark.parametrize(
    ("angles", "is_turned"),
    [
        (Angles(0.05, 0.0, (0.01, 0.01)), False),  # a cosine of 4e-7
        (Angles(0.051, 0.0, (0.01, 0.01)), True),
        (Angles(0.0, -0.051, (0.01, 0.01)), True),
        (Angles(0.2, 0.0, (0.1, 0.01)), False),  # within twice its sigma
        (Angles(0.2, 0.0, (0.09, 0.01)), True),
    ],
)
def test_what_is_little_or_chance_is_not_turned(angles: Angles, is_turned: bool):
    (line,) = alignment_lines(alignment(angles, None))
    assert line.endswith("; nothing to turn") != is_turned


def test_angles_for_programs():
    assert alignment_as_dict(alignment(Angles(0.5, -0.25, (0.02, 0.03)), None)) == {
        "board": {"right_deg": 0.5, "down_deg": -0.25, "sigma_deg": [0.02, 0.03]},
        "stage": None,
        "calibrated": True,
    }


def test_what_a_calibration_meant_is_told_as_far_as_it_is_known() -> None:
    bare: Any = SimpleNamespace(id=3, stage=None, zero_sigma_mm=None, disagreement_pct=None)
    assert use_lines(bare) == [
        "calibration 3: distances are positions of the stage as it reads them"
    ]
    assert use_as_dict(bare)["cameras_against_stage_pct"] is None
    assert use_as_dict(bare)["stage"] is None
    half: Any = SimpleNamespace(
        id=3, stage=SimpleNamespace(scale=1.0, axis_deg=0.0), zero_sigma_mm=None,
        disagreement_pct=0.25,
    )  # fmt: skip
    assert use_lines(half) == [
        "calibration 3: distances are positions of the stage as it reads them",
        "depth by the cameras of the calibration alone: differs by 0.2500 % rms",
    ]
    whole: Any = SimpleNamespace(
        id=3, stage=SimpleNamespace(scale=1.0015, axis_deg=0.5), zero_sigma_mm=0.15,
        disagreement_pct=None,
    )  # fmt: skip
    assert use_lines(whole) == [
        "calibration 3: distances by its stage: scale 1.00150, axis 0.50 deg off the optical axis, "
        "zero known to 0.300 mm (k=2)"
    ]


def sweep_result(**changes: object) -> Any:
    curve = SimpleNamespace(
        model="physical", params={"a": 1.0}, focus_mm=700.0, focus_sigma_mm=0.25,
        valid_mm=(400.0, 1200.0),
    )  # fmt: skip
    holdout = SimpleNamespace(rms_pct=0.01, rms_mm=0.1, max_pct=0.02, bias_pct=-0.005)
    plain: dict[str, object] = {
        "rig": "sim", "headline": GOOD, "sweep_id": 5, "database": "db", "report": "r.html",
        "curve_id": 7, "fit": SimpleNamespace(best=curve, holdout=holdout, warnings=("odd",)),
        "stops": (), "holdout": {}, "failed_gates": (), "alignment": Alignment(None, None, False),
        "epipolar_px": {"mean": 0.1, "p95": 0.2, "max": 0.3}, "row_lines": ("rows: well",),
        "calibration": None, "times": None,
    }  # fmt: skip
    return SimpleNamespace(**(plain | changes))


def test_a_sweep_is_told_with_its_most_important_line_first():
    assert result_lines(sweep_result()) == [
        f"sim: {GOOD}",
        "held-out distances: rms 0.0100 % (0.100 mm), largest 0.0200 %, bias -0.0050 %",
        "curve 7: physical, focus distance 700.00 +- 0.50 mm (k=2)",
        "epipolar error: mean 0.100 px, 95th percentile 0.200 px, largest 0.300 px",
        "rows: well",
        "note: odd",
        "sweep 5 in db",
        "report: r.html",
    ]


@pytest.mark.parametrize("lost", ["focus_mm", "focus_sigma_mm"])
def test_a_focus_that_is_not_known_lies_outside(lost: str):
    result = sweep_result(epipolar_px=None, row_lines=())
    setattr(result.fit.best, lost, None)
    result.fit.holdout, result.fit.warnings = None, ()
    assert result_lines(result)[1:] == [
        "curve 7: physical, focus distance outside the sweep", "sweep 5 in db", "report: r.html",
    ]  # fmt: skip


def test_a_sweep_for_programs():
    told = result_as_dict(sweep_result())
    assert told["holdout"] is None
    assert told["depth_error"] == {
        "at_mm": 1000.0, "k": 2, "board_plane_mm": 0.1, "pixel_median_mm": 1.8
    }  # fmt: skip
    assert told["calibration"] is None
    assert told["times"] is None
    assert told["points"] == []
    assert told["curve"] == {
        "id": 7, "model": "physical", "params": {"a": 1.0}, "focus_mm": 700.0,
        "valid_mm": [400.0, 1200.0],
    }  # fmt: skip
    bare: Any = SimpleNamespace(id=3, stage=None, zero_sigma_mm=None, disagreement_pct=None)
    without_point = SimpleNamespace(point=None)
    with_use = result_as_dict(
        sweep_result(calibration=bare, holdout={"rms_pct": 1.0}, stops=(without_point,))
    )
    assert with_use["calibration"] == use_as_dict(bare)
    assert with_use["holdout"] == {"rms_pct": 1.0}
    assert with_use["points"] == []


def test_a_calibration_and_the_time_are_told_where_there_are_some():
    bare: Any = SimpleNamespace(id=3, stage=None, zero_sigma_mm=None, disagreement_pct=None)
    times = SweepTimes(moves_s=10.0, settling_s=2.5, exposures_s=7.5)
    lines = result_lines(sweep_result(calibration=bare, times=times))
    assert lines[3] == "calibration 3: distances are positions of the stage as it reads them"
    assert lines[-3:] == [
        "moves 10.0 s + settling 2.5 s + exposures 7.5 s = 20.0 s", "sweep 5 in db",
        "report: r.html",
    ]  # fmt: skip
    told = result_as_dict(sweep_result(times=times))["times"]
    assert isinstance(told, dict)
    assert told["settling_s"] == 2.5
