"""Habits of the shell: help, completion, wrong values, closed ends, Ctrl-C."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rig.cli.verbs import VERBS
from rig.database import open_store
from rig.sweep.request import SweepRequest, plan_of
from tests.support.command import Command

RIG = (sys.executable, "-m", "rig")
HEAVY = (
    "numpy",
    "numba",
    "cv2",
    "scipy",
    "sqlalchemy",
    "pydantic",
    "matplotlib",
    "depthai",
    "mcap",
)
LIBRARY = re.compile(r"Input should|Value error|valid (integer|number)|unable to parse")


def program(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*RIG, *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


def completed(line: str, database: Path) -> list[str]:
    """The words that bash would offer at the end of a line."""
    words = line.split(" ")
    answer = program(
        COMP_WORDS=line,
        COMP_CWORD=str(len(words) - 1),
        _RIG_COMPLETE="complete_bash",
        RIG_DATABASE=f"sqlite:///{database}",
    )
    assert answer.stderr == ""
    return answer.stdout.split()


def test_the_module_is_the_program():
    answer = program("--version")
    assert answer.returncode == 0
    assert re.fullmatch(r"rig \d+\.\d+\.\d+\S*\n", answer.stdout)
    assert "Usage: rig sweep" in program("sweep").stderr


def test_help_at_80_columns_cuts_no_summary(rig: Command, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "80")
    lines = rig("--help").out.splitlines()
    assert max(map(len, lines)) <= 80
    for title, verbs in VERBS.items():
        assert f"{title}:" in lines
        for name, verb in verbs.items():
            assert f"  {name:<10}  {verb.summary}" in lines
            assert verb.summary.endswith(".")
    assert lines[-4] == "Begin with:"
    assert [line.split("  ")[1] for line in lines[-3:]] == [
        "rig sweep sim",
        "rig capture sim",
        "rig devices",
    ]


@pytest.mark.parametrize("verb", [name for verbs in VERBS.values() for name in verbs])
def test_every_verb_has_a_help_without_anything_cut(
    rig: Command, monkeypatch: pytest.MonkeyPatch, verb: str
):
    monkeypatch.setenv("COLUMNS", "80")
    answer = rig(verb, "--help")
    assert answer.code == 0
    assert f"Usage: rig {verb}" in answer.out
    assert "..." not in answer.out.replace("[ARGS]...", "").replace("]...", "").replace("MM...", "")
    assert max(map(len, answer.out.splitlines())) <= 80


@pytest.mark.parametrize("code", ["import rig", "import sys; sys.argv = ['rig', '--help']\n{main}"])
def test_nothing_heavy_is_imported_before_a_verb_needs_it(code: str):
    main = "from rig.cli import main\ntry:\n    main()\nexcept SystemExit:\n    pass"
    tail = f"\nimport sys\nprint([m for m in {HEAVY!r} if m in sys.modules], file=sys.stderr)"
    answer = subprocess.run(
        [sys.executable, "-c", code.replace("{main}", main) + tail],
        capture_output=True,
        text=True,
        check=True,
    )
    assert answer.stderr == "[]\n"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("rig c", {"calibrate", "capture", "check", "compare", "completion"}),
        ("rig profile s", {"show", "schema"}),
        ("rig sweep sim-o", {"sim-oak", "sim-oak-d"}),
        ("rig profile check v4l2-p", {"v4l2-pair-grbl", "v4l2-pair-marlin"}),
        ("rig export 1 --format c", {"colmap", "csv"}),
        ("rig import sim f --format k", {"kalibr"}),
        ("rig sweep sim --calibration n", {"none"}),
    ],
)
def test_words_are_completed_and_no_database_is_made(tmp_path: Path, line: str, words: set[str]):
    assert set(completed(line, tmp_path / "none.sqlite")) == words
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_numbers_are_completed_from_the_database(tmp_path: Path):
    from rig.profile.load import load_profile

    path = tmp_path / "bench.sqlite"
    profile = load_profile("sim")
    stops, samples = plan_of(profile, SweepRequest())
    with open_store(f"sqlite:///{path}") as store:
        for _ in range(2):
            store.create_sweep(
                rig=profile.name,
                profile=profile.model_dump(mode="json"),
                stops=stops,
                samples_per_stop=samples,
                versions={},
                devices={},
            )
    assert completed("rig report ", path) == ["2", "1"]
    assert completed("rig export ", path) == ["2", "1"]
    assert completed("rig capture sim --curve ", path) == []
    path.write_bytes(b"no database")
    assert completed("rig report ", path) == []


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_is_printed(rig: Command, shell: str):
    answer = rig("completion", shell)
    assert answer.code == 0
    assert "_RIG_COMPLETE" in answer.out


WRONG = """
sweep sim --count 1
sweep sim --count -3
sweep sim --count 2.5
sweep sim --count 1000000
sweep sim --samples 1000000000
sweep sim --from-mm nan --dry-run
sweep sim --to-mm inf --dry-run
sweep sim --at-mm nan --dry-run
sweep sim --at-mm 500 500 --dry-run
sweep sim --from-mm 500 --to-mm 500 --dry-run
sweep sim --resume 0
sweep sim --calibration 1.5
sweep sim --set sweep.count
sweep sim --set .=3
sweep sim --set sweep.count=none --dry-run
sweep sim --db nowhere
capture sim --frames 0
capture sim --seconds nan
capture sim --seconds inf
capture sim --seconds -1
capture sim --curve 0
capture sim --slopes-only --curve 3
compare sim --frames -1
compare sim --sweep 0
check sim --calibration -1
check sim --calibration newest
calibrate sim --pictures 2
calibrate sim --lens pinhole
calibrate sim --start 0
calibrate sim --frames /no/where
calibrate sim --frames left=
fit 0
fit one
fit 1 --calibration q
report 1.5
history --db nowhere
export 0 --format ros
export 1 --format pdf
export 1 --format ply --capture . --frame -1
import sim . --format ply
devices --timeout-s nan
devices --timeout-s 1e9
devices --timeout-s soon
target --kind charuco --out x.xyz
target --kind charuco --out x.pdf --size 9
target --kind charuco --out x.pdf --size 0x0
target --kind charuco --out x.pdf --square-mm nan
target --kind charuco --out x.pdf --square-mm 0
target --kind charuco --out x.pdf --marker-mm 40
target --kind charuco --out x.pdf --dictionary 3X3
target --kind charuco --out x.pdf --page a9
target --kind charuco --out x.pdf --page 10x10
target --kind charuco --out x.pdf --border-mm -1
target --kind charuco --out x.pdf --dpi inf
target --kind charuco --out x.png --dpi 9999
profile show sim --set pitch_mm=far
profile new bench --views 9
profile new bench --camera webcam
sim stage --tcp 99999
sim stage --protocol klingon
completion tcsh
"""


@pytest.mark.parametrize("line", WRONG.strip().splitlines())
def test_a_wrong_value_of_an_option_is_exit_code_2(
    rig: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, line: str
):
    monkeypatch.chdir(tmp_path)
    answer = rig(*line.split())
    assert answer.code == 2, answer.err
    assert answer.out == ""
    assert not LIBRARY.search(answer.err), answer.err
    assert answer.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_reader_that_left_is_told_nothing():
    with subprocess.Popen(
        [*RIG, "profile", "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as reading:
        assert reading.stdout is not None
        assert reading.stderr is not None
        reading.stdout.close()
        assert reading.stderr.read() == b""
        assert reading.wait() == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
def test_a_full_disk_below_stdout_is_one_line():
    with Path("/dev/full").open("wb") as full:
        answer = subprocess.run(
            [*RIG, "profile", "list"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert answer.returncode == 1
    assert answer.stderr.startswith("rig: cannot write to stdout: No space left")
    assert answer.stderr.count("\n") == 1


def test_ctrl_c_is_one_line_and_exit_code_130(rig: Command, monkeypatch: pytest.MonkeyPatch):
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("rig.cli.history.history", interrupted)
    answer = rig("history")
    assert answer.code == 130
    assert answer.err == "rig: interrupted; what was stored before is kept\n"


def test_a_mistyped_verb_is_told_the_nearest(rig: Command):
    answer = rig("swep")
    assert answer.code == 2
    assert "Did you mean 'sweep'" in answer.err
