"""Progress on stderr: how far, and how long it will still take."""

import sys

import pytest

from rig.cli.progress import ProgressLine


class Hands:
    """A clock that stands where it is put."""

    at_s = 0.0

    def __call__(self) -> float:
        return self.at_s


def told(capsys: pytest.CaptureFixture[str], at_s: list[float], total: int | None) -> list[str]:
    clock = Hands()
    with ProgressLine(total, clock) as progress:
        for done, clock.at_s in enumerate(at_s, start=1):
            progress.report(done, "sample")
    return capsys.readouterr().err.splitlines()


@pytest.mark.parametrize("slow", [0, 1, 2, 5])
def test_what_takes_long_once_is_not_in_the_pace(capsys: pytest.CaptureFixture[str], slow: int):
    """Kernels are compiled for 300 s before one of the first reports; then a sample takes 2 s."""
    intervals_s = [300.0 if number == slow else 2.0 for number in range(20)]
    at_s = [sum(intervals_s[: number + 1]) for number in range(20)]
    lines = told(capsys, at_s, total=50)
    assert lines[-1] == "[20/50] sample, 1 min 0 s left"


def test_the_pace_follows_the_run(capsys: pytest.CaptureFixture[str]):
    at_s = [*(2.0 * number for number in range(10)), *(18.0 + 4.0 * n for n in range(1, 11))]
    assert told(capsys, at_s, total=30)[-1] == "[20/30] sample, 0 min 40 s left"


def test_nothing_is_estimated_from_one_report_or_without_a_total(
    capsys: pytest.CaptureFixture[str],
):
    assert told(capsys, [5.0], total=10) == ["[1/10] sample"]
    assert told(capsys, [5.0, 10.0, 15.0], total=None)[-1] == "[3] sample"
    assert told(capsys, [5.0, 10.0, 15.0], total=3)[-1] == "[3/3] sample"


def test_on_a_terminal_another_line_takes_the_place_of_the_live_one(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with ProgressLine(None, Hands()) as progress:
        progress.tell("first")
        progress.report(1, "ab")
        progress.tell("full")
        progress.report(2, "ab")
    live = "\r[1] ab"
    assert capsys.readouterr().err == f"first\n{live}\r{6 * ' '}\rfull\n\r[2] ab\n"
