"""A capture from its first frame to its summary: what fails, what is interrupted, what is said."""

import json
import math
import signal
import threading
from pathlib import Path

import pytest
from rig_sim.faults import FaultyCamera, UnpluggedCamera

from rig.capture.capture import CaptureRequest, CaptureSummary, capture_depth
from rig.capture.folder import CaptureFolder
from rig.capture.on_rig import capture_on_rig
from rig.capture.output import WantedOutput
from rig.capture.picture import write_picture
from rig.cli.capture import saved
from rig.database import open_store
from rig.devices import SystemClock
from rig.errors import DeviceLostError, RigError, StoreError
from rig.live.captured import read_capture
from rig.live.frame import DepthFrame
from rig.profile.load import load_profile
from rig.recording import recorded
from rig.stored import CurveChoice, RunChoice
from rig.testing.simulated import PROFILE
from tests.support.command import Command
from tests.support.stores import sqlite_url
from tests.support.sweeps import stored_sweep
from tests.unit.capture.scripted import ScriptedOutput, frames
from tests.unit.live.devices import TINY, tiny_rig

BENCH = (
    "name=bench",
    "camera.width_px=64",
    "camera.height_px=40",
    "world.renderer=analytic",
    "world.capture_scene=board",
)


def wanted(*outputs: ScriptedOutput, is_kept: bool = True) -> tuple[WantedOutput, ...]:
    return tuple(
        WantedOutput(lambda _, output=output: output, is_kept=is_kept) for output in outputs
    )


def request(
    *outputs: ScriptedOutput, count: int | None = 4, is_kept: bool = True
) -> CaptureRequest:
    return CaptureRequest(
        frames=count, duration_s=None, folder=None, outputs=wanted(*outputs, is_kept=is_kept)
    )


def captured(asked: CaptureRequest, told: list[str] | None = None) -> CaptureSummary:
    told = [] if told is None else told
    with tiny_rig()[0] as camera:
        return capture_depth(camera, asked, lambda *_: None, told.append)


def test_files_and_recording_hold_every_frame(tmp_path: Path):
    asked = CaptureRequest(
        frames=3, duration_s=None, folder=tmp_path / "out", recording=tmp_path / "x.mcap"
    )
    summary = captured(asked)
    assert (summary.frames, summary.failure, summary.is_interrupted) == (3, None, False)
    assert [(o.name, o.written, o.dropped) for o in summary.outputs] == [
        ("recording", 3, 0),
        ("files", 3, 0),
    ]
    assert len(list(recorded(tmp_path / "x.mcap"))) == 3
    found = list(read_capture(tmp_path / "out"))
    assert [frame.index for frame in found] == [0, 1, 2]
    for frame in found:
        assert 0.0 < frame.facts["measuring_s"] < frame.facts["latency_s"]
    assert summary.time_ns == (found[0].time_ns, found[2].time_ns)
    assert summary.picture == tmp_path / "out" / "last_frame.png"
    assert all(output.latency_s.median > summary.latency_s.median for output in summary.outputs)


def test_the_pace_is_stated_with_and_without_waiting_for_the_camera():
    asked = CaptureRequest(frames=3, duration_s=None, folder=None)
    camera, _ = tiny_rig(clock=SystemClock())
    with camera:
        summary = capture_depth(camera, asked, lambda *_: None)
    assert summary.frames_per_s == 3 / summary.took_s
    assert summary.measured_per_s == 3 / (summary.took_s - summary.waited_s)
    assert 0.0 < summary.waited_s < summary.took_s
    assert summary.is_simulated
    nothing = captured(CaptureRequest(frames=None, duration_s=0.0, folder=None))
    assert nothing.frames == 1  # one is always measured


def test_what_was_to_be_kept_and_failed_is_told_and_the_capture_goes_on():
    told: list[str] = []
    full, fine = ScriptedOutput("files", fails_at=1), ScriptedOutput("recording")
    summary = captured(request(full, fine), told)
    assert summary.frames == 4
    assert fine.taken == [0, 1, 2, 3]
    assert str(summary.failure) == "the disk is full; make room"
    assert len(told) == 1


def test_a_page_that_fails_is_no_failure_of_the_capture():
    told: list[str] = []
    asked = CaptureRequest(
        frames=4,
        duration_s=None,
        folder=None,
        outputs=(
            *wanted(ScriptedOutput("view", fails_at=0), is_kept=False),
            *wanted(ScriptedOutput("files")),
        ),
    )
    summary = captured(asked, told)
    assert (summary.frames, summary.failure) == (4, None)
    view, files = summary.outputs
    assert (view.written, view.dropped, view.is_kept) == (0, 4, False)
    assert (files.written, files.dropped) == (4, 0)
    assert told == ["rig: view: the disk is full; make room; the capture goes on without it"]


def test_where_nothing_takes_depth_any_more_the_capture_ends():
    full = ScriptedOutput(fails_at=0)
    summary = captured(request(full, count=None))
    assert summary.failure is not None
    assert summary.frames > 0
    assert full.closed == 1


def test_a_folder_that_vanishes_is_one_error_at_the_end(tmp_path: Path):
    asked = CaptureRequest(
        frames=2, duration_s=None, folder=None, outputs=(WantedOutput(in_a_hole, is_kept=True),)
    )
    summary = captured(asked)
    assert isinstance(summary.failure, StoreError)
    assert not (tmp_path / "out").exists()


def in_a_hole(camera: object) -> ScriptedOutput:
    del camera
    return ScriptedOutput(error=StoreError("out: is gone", advice="mount it"), fails_at=0)


def test_ctrl_c_finishes_and_closes_what_was_taken():
    output = ScriptedOutput()

    def progress(done: int, _: str) -> None:
        if done == 3:
            signal.raise_signal(signal.SIGINT)

    with tiny_rig()[0] as camera:
        summary = capture_depth(camera, request(output, count=None), progress)
    assert summary.is_interrupted
    assert (output.taken, output.closed, summary.frames) == ([0, 1, 2], 1, 3)
    assert saved(summary) == "3 multi-views were measured, kept 3 by files"


class InterruptsAtTheEnd(ScriptedOutput):
    """Ctrl-C comes while it is closed."""

    def close(self) -> None:
        super().close()
        waiting = threading.main_thread().ident
        assert waiting is not None
        signal.pthread_kill(waiting, signal.SIGINT)  # as a terminal does


def test_ctrl_c_at_the_end_waits_for_what_is_being_written():
    output = InterruptsAtTheEnd()
    summary = captured(request(output))
    assert summary.is_interrupted
    assert [(o.written, o.failure) for o in summary.outputs] == [(4, None)]


def test_a_second_ctrl_c_gives_up():
    hanging = ScriptedOutput("view", is_open=False)

    def progress(done: int, _: str) -> None:
        if done == 1:
            signal.raise_signal(signal.SIGINT)

    asked = request(hanging, InterruptsAtTheEnd(), count=None)
    with tiny_rig()[0] as camera, pytest.raises(KeyboardInterrupt):
        capture_depth(camera, asked, progress)
    assert hanging.taken == []
    hanging.gate.set()


def test_a_camera_that_is_lost_ends_the_capture_and_what_came_is_kept():
    camera, _ = tiny_rig(
        lambda device, world: FaultyCamera(
            device, UnpluggedCamera(after=2), clock=world.clock, max_skew_s=0.005, timeout_s=3.0
        )
    )
    output = ScriptedOutput()
    with camera, pytest.raises(DeviceLostError):
        capture_depth(camera, request(output, count=None), lambda *_: None)
    assert (output.taken, output.closed) == ([0, 1], 1)


@pytest.mark.parametrize("is_kept", [True, False])
def test_in_real_time_a_stalled_output_never_stops_the_capture(*, is_kept: bool):
    stalled = ScriptedOutput("files", is_open=False)
    camera, _ = tiny_rig(clock=SystemClock())

    def progress(done: int, _: str) -> None:
        if done == 12:  # more than may wait
            stalled.gate.set()

    with camera:
        summary = capture_depth(camera, request(stalled, count=12, is_kept=is_kept), progress)
    (output,) = summary.outputs
    assert summary.frames == 12
    assert output.written + output.dropped == 12
    # One is being written, eight or one wait.
    assert output.written in ((8, 9) if is_kept else (1, 2))
    assert stalled.taken[-1] == 11
    assert not [t for t in threading.enumerate() if t.name.startswith("output")]


def test_the_folder_shows_its_last_frame(tmp_path: Path):
    first, last = frames(2)
    camera, _ = tiny_rig()
    folder = CaptureFolder(tmp_path / "out", camera.run)
    folder.write(first)
    assert not (tmp_path / "out" / "last_frame.png").exists()
    folder.write(last)
    folder.close()
    shown = write_picture(tmp_path / "same.png", last, camera.run.profile.reference)
    assert (tmp_path / "out" / "last_frame.png").read_bytes() == shown.read_bytes()
    empty = CaptureFolder(tmp_path / "none", camera.run)
    empty.close()
    assert [path.name for path in (tmp_path / "none").iterdir()] == ["frames.jsonl"]


def test_a_folder_that_holds_a_capture_takes_no_second_one(tmp_path: Path):
    camera, _ = tiny_rig()
    first, second = frames(2)
    folder = CaptureFolder(tmp_path, camera.run)
    folder.write(first)
    folder.write(second)
    folder.close()
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    says = r"found a capture of 2 multi-views there .* choose another folder with --out"
    for _ in range(2):  # the first refusal has let go of the folder
        with pytest.raises(StoreError, match=says):
            CaptureFolder(tmp_path, camera.run)
    with pytest.raises(StoreError, match=says):
        CaptureFolder(tmp_path, camera.run, resumes=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_where_the_folder_is_refused_no_recording_is_begun(tmp_path: Path):
    camera, _ = tiny_rig()
    (tmp_path / "frames.jsonl").write_text("{}\n")
    wanted = CaptureRequest(1, None, tmp_path, recording=tmp_path / "new.mcap")
    with camera, pytest.raises(StoreError, match="found a capture of 1 multi-views"):
        capture_depth(camera, wanted, lambda *_: None)
    assert [path.name for path in tmp_path.iterdir()] == ["frames.jsonl"]


def test_a_scan_that_is_resumed_is_written_again(tmp_path: Path):
    camera, _ = tiny_rig()
    (only,) = frames(1)
    folder = CaptureFolder(tmp_path, camera.run)
    folder.write(only)
    folder.close()
    again = CaptureFolder(tmp_path, camera.run, resumes=True)
    again.write(only)
    again.close()
    assert len((tmp_path / "frames.jsonl").read_text().splitlines()) == 1


def test_a_link_in_place_of_the_list_of_multi_views_is_no_capture_and_is_refused(tmp_path: Path):
    camera, _ = tiny_rig()
    outside = tmp_path / "outside"
    outside.write_text("precious\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "frames.jsonl").symlink_to(outside)
    with pytest.raises(StoreError, match=r"cannot be written: .*symbolic links"):
        CaptureFolder(tmp_path / "out", camera.run)
    assert outside.read_text() == "precious\n"


def test_the_folder_knows_who_captured_it_and_with_what(tmp_path: Path):
    camera, _ = tiny_rig()
    wanted = CaptureRequest(1, None, tmp_path / "out", note="cold", tags=("night",))
    with camera:
        capture_depth(camera, wanted, lambda *_: None)
        serial = camera.identity["serial"]
    made = json.loads((tmp_path / "out" / "run.json").read_text())
    assert (made["note"], made["tags"], made["unit"]) == ("cold", ["night"], "")
    assert made["devices"]["camera"]["serial"] == serial
    assert made["profile"]["name"] == made["rig"] == camera.run.profile.name
    assert {"user", "host", "command", "versions"} <= set(made)


SLOPES = (
    "sim",
    "--slopes-only",
    "--set",
    "camera.width_px=64",
    "--set",
    "camera.height_px=40",
    "--set",
    "slopes.range_px=[-2.0, 3.0]",
    "--set",
    "quality.valid_share_pct=0",
    "--set",
    "world.renderer=analytic",
    "--set",
    "world.capture_scene=board",
    "--calibration",
    "none",
)


def test_the_verb_states_times_and_drops_of_every_place(rig: Command, tmp_path: Path):
    out = tmp_path / "out"
    answer = rig("capture", *SLOPES, "--frames", 2, "--out", out, "--json")
    assert answer.code == 0, answer.err
    told = answer.json
    assert told["frames"] == 2
    assert told["dropped"] == 0
    assert told["dropped_by_reason"] == {"late": 0, "skew": 0, "files": 0}
    assert told["outputs"]["files"]["written"] == 2
    assert told["outputs"]["files"]["failed"] is None
    assert told["latency_ms"]["p50"] > told["measuring_ms"]["p50"] > 0.0
    assert told["outputs"]["files"]["latency_ms"]["p50"] > told["latency_ms"]["p50"]
    assert told["fps_measuring"] > told["fps"]
    first, last = told["time_ns"]
    lines = [json.loads(line) for line in (out / "frames.jsonl").read_text().splitlines()]
    assert [line["time_ns"] for line in lines] == [first, last]
    words = rig("capture", *SLOPES, "--frames", 1, "--out", tmp_path / "two").out
    assert "per s, " in words
    assert "without waiting for the simulated camera" in words
    assert "files: 1 taken, 0 dropped" in words


def test_the_verb_ends_with_the_error_of_what_was_to_be_kept(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def refuse(_: object, __: object) -> None:
        raise RigError("no space left", advice="make room")

    monkeypatch.setattr(CaptureFolder, "write", refuse)
    answer = rig("capture", *SLOPES, "--out", tmp_path / "out", "--json")
    assert answer.code == 1
    assert answer.json["outputs"]["files"]["failed"] == "no space left; make room"
    assert answer.json["outputs"]["files"]["written"] == 0
    assert answer.err.splitlines()[-1] == "rig: no space left; make room"
    assert not math.isnan(answer.json["fps"])


def test_a_replay_goes_on_whose_profile_is_edited_and_whose_file_is_removed(tmp_path: Path):
    recording = tmp_path / "x.mcap"
    captured(CaptureRequest(frames=5, duration_s=None, folder=None, recording=recording))
    replay = f'camera={{kind="recording", file="{recording}"}}'
    path = tmp_path / "edited.toml"
    path.write_text(PROFILE.read_text())
    profile = load_profile(str(path), [*TINY, replay, "quality.valid_share_pct=0"])

    class Editing(ScriptedOutput):
        def write(self, frame: DepthFrame) -> None:
            super().write(frame)
            path.write_text("no profile any more")
            recording.unlink(missing_ok=True)

    output = Editing()
    choice = RunChoice(sqlite_url(tmp_path), calibration="none", curve="none")
    told: list[str] = []
    summary = capture_on_rig(
        profile, choice, request(output, count=None), lambda *_: None, told.append
    )
    assert (output.taken, summary.frames, summary.failure) == ([0, 1, 2, 3, 4], 5, None)
    assert (summary.dropped, told) == ({"skew": 0}, [])


@pytest.mark.slow
def test_a_curve_that_is_replaced_meanwhile_is_told_and_the_run_keeps_its_own(tmp_path: Path):
    store, result = stored_sweep(tmp_path)
    profile = load_profile("sim", [*BENCH, "quality.valid_share_pct=0"])
    url = sqlite_url(tmp_path)
    first = store.active_curve("bench").id

    class Replacing(ScriptedOutput):
        def write(self, frame: DepthFrame) -> None:
            super().write(frame)
            with open_store(url) as other:
                curve = other.curve(first)
                other.save_curve(curve.sweep_id, curve=curve.curve, holdout={}, versions={})

    del result
    store.close()
    told: list[str] = []
    cases: tuple[tuple[CurveChoice, list[str]], ...] = (
        ("newest", [f"rig: curve {first + 1} was made meanwhile; this capture used curve {first}"]),
        (first, []),
    )
    for curve, lines in cases:
        told.clear()
        summary = capture_on_rig(
            profile,
            RunChoice(url, curve=curve),
            request(Replacing(), count=1),
            lambda *_: None,
            told.append,
        )
        assert summary.curve is not None
        assert summary.curve.id == first
        assert [line.removesuffix(" to its end") for line in told] == lines
