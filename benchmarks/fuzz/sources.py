"""What is read: every parser with its valid inputs and the changes that suit them."""

import random
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rig_drivers.command.answer import NoAnswerError, read_answer
from rig_drivers.grbl import dialect as grbl
from rig_drivers.marlin import dialect as marlin
from rig_drivers.marlin.settings import read_axis
from rig_drivers.stored.folder import FolderCamera
from rig_drivers.zaber.message import checksum, parse_message

from benchmarks.fuzz import mutate
from benchmarks.fuzz.database import Database
from benchmarks.fuzz.foreign import FORMATS, imports
from benchmarks.fuzz.pictures import changed, valid_pictures
from benchmarks.fuzz.recordings import changed as changed_recording
from benchmarks.fuzz.recordings import valid_recordings
from rig.depth import read_pfm, write_pfm
from rig.devices import SystemClock
from rig.errors import FormatError
from rig.places import profile_files
from rig.profile import FolderCameraConfig, ViewConfig
from rig.profile.load import load_profile
from rig.recording import recorded
from rig.sweep.request import SweepRequest, plan_of, planned_times

Read = Callable[[], object]
Draw = Callable[[random.Random], Read]
"""From a source of chance to one input that waits to be read."""

STAGE_LINES: Mapping[str, tuple[Callable[[str], object], tuple[str, ...]]] = {
    "grbl": (
        grbl.parse_reply,
        (
            "ok",
            "error:9",
            "ALARM:1",
            "Grbl 1.1h ['$' for help]",
            "$130=200.000",
            "<Idle|MPos:-5.000,-5.000,-5.000|FS:0,0|Pn:XYZ|WCO:0.000,0.000,0.000>",
            "[MSG:INFO: Grbl_ESP32 Ver 1.3a Date 20200426]",
            "[OPT:VZL,15,128]",
            "GrblHAL 1.1f ['$' or '$HELP' for help]",
            "Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]",
            "$130=200.000 (x max travel, mm)",
            "$/axes/x/max_travel_mm=300.000",
            "$N0=G21",
            "<Hold:0|WPos:1.000,2.000,3.000|Bf:15,128>",
            "<Run|MPos:1.000,2.000,3.000,4.000|Ov:100,100,100>",
        ),
    ),
    "marlin": (
        marlin.parse_reply,
        (
            "ok N12 P15 B3",
            "Resend: 12",
            "echo:busy: processing",
            "start",
            "Error:checksum mismatch, Last Line: 11",
            "X:0.00 Y:0.00 Z:10.00 E:0.00 Count X:0 Y:0 Z:4000",
            "echo:  M92 X80.00 Y80.00 Z400.00 E93.00",
            "ok X:0.00 Y:0.00 Z:10.00 E:0.00 Count X:0 Y:0 Z:4000",
            "X:0.00 Y:0.00 Z:10.00 E:0.00",
            "X:0.00 Y:0.00 Z:10.00 Count A:0 B:0 Z:4000",
            "X:0.00 Y:0.00 Z:10.00 Count X:0 Y:0",
            "X:0.00 Y:0.00 X:10.00 Count X:0 Y:0 X:4000",
            "X:0.00 Y:0.00 Z:10.00 Count X:0 Y:0 Z:4000",
            "Error:Printer halted. kill() called!",
            "echo:Printer stopped due to errors. Fix the error and use M999 to restart.",
            'echo:Unknown command: "G999"',
            "Error:No Checksum with line number, Last Line: 3",
        ),
    ),
    "zaber": (
        parse_message,
        (
            "@01 0 00 OK IDLE -- 0",
            f"@01 1 42 RJ BUSY WR BADDATA:{checksum('01 1 42 RJ BUSY WR BADDATA')}",
            "!01 1 IDLE --",
            "#01 0 encoder.error",
            f"!01 1 BUSY FF:{checksum('01 1 BUSY FF')}",
            f"#01 0 text:{checksum('01 0 text')}",
            "@01 0 00 OK IDLE WR 1000 2000",
        ),
    ),
}
OVERRIDES = (
    *("sweep.samples=3", "camera.width_px=0", "views.0.x_steps=-1.02", "stage.kind=command", "=1"),
    *("camera.kind=v4l2", "views=[]", "target.square_mm=nan", "a.b.c.d=[", "sweep={}", "name"),
    *("stage.travel_mm=[0, 1e9]", "sweep.to_mm=1e308", "slopes.range_px=[9, -9]", "views.9.name=1"),
)
HEADS = (b"PF\n2 2\n-1\n", b"Pf\n4 3\n1.0\n", b"Pf\n4 0\n-1\n", b"Pf\n4 3\n0\n", b"Pf 4 3 -1 ")
SETTINGS = """echo:  M201 X3000.00 Y3000.00 Z100.00
echo:  M203 X500.00 Y500.00 Z12.00
echo:  M204 P3000.00 R3000.00 T3000.00
echo:  M92 X80.00 Y80.00 Z400.00
echo:  M211 S1
echo:Soft endstops: On  Min:  X0.00 Y0.00 Z0.00   Max:  X235.00 Y235.00 Z250.00"""
ANSWERS = (
    *('{"position_mm": 7}', '{"position_mm": true}', '{"position_mm": 1e300}', '{"stopped": 1}'),
    *('{"position_mm": 400.0}\n\n', '{"stopped": true, "error": "x"}', "[]", "1\n2"),
    '{"error": "' + "x" * 100_000 + '"}',
    *('{"position_mm": 400.0}', '{"position_mm": null}', '{"stopped": true}', '{"error": "x"}'),
)


@dataclass(frozen=True)
class Source:
    """One parser."""

    name: str
    prepare: Callable[[Path], Draw]
    """Makes its valid inputs in a folder."""
    share: float = 1.0
    """Of the count: where one input takes many times as long as elsewhere."""


def profiles(folder: Path) -> Draw:
    """TOML: loaded, planned and its time estimated, as `rig sweep --dry-run` does."""
    valid = [path.read_text() for path in profile_files()]
    path = folder / "bench.toml"

    def draw(rng: random.Random) -> Read:
        overrides = tuple(rng.choice(OVERRIDES) for _ in range(rng.choice((0, 0, 0, 1, 2))))
        overrides = tuple(mutate.text(rng, o) if rng.random() < 0.3 else o for o in overrides)
        if rng.random() < 0.03:
            name = rng.choice(("sim", "simm", "qqqq", "none.toml", "./sim", "", "sim-real"))
            return lambda: _plan(name, overrides)
        text = rng.choice(valid)
        change = mutate.text
        if rng.random() < 0.1:
            change = rng.choice((mutate.block, mutate.many))
        content = change(rng, text).encode(errors="replace")
        path.write_bytes(mutate.raw(rng, content) if rng.random() < 0.02 else content)
        return lambda: _plan(str(path), overrides)

    def _plan(name: str, overrides: Sequence[str]) -> object:
        profile = load_profile(name, overrides)
        stops, samples = plan_of(profile, SweepRequest())
        return planned_times(profile, stops, samples)

    return draw


def maps(folder: Path) -> Draw:
    """PFM."""
    path = folder / "map.pfm"
    write_pfm(path, np.arange(12, dtype=np.float32).reshape(3, 4))
    valid = path.read_bytes()

    def draw(rng: random.Random) -> Read:
        if rng.random() < 0.1:
            head = rng.choice(HEADS)
            path.write_bytes(head + valid[13:])
        elif rng.random() < 0.5:
            head, data = valid[:13], valid[13:]
            text = mutate.text(rng, head.decode())
            path.write_bytes(text.encode(errors="replace") + data)
        else:
            path.write_bytes(mutate.raw(rng, valid))
        return lambda: read_pfm(path)

    return draw


def pictures(folder: Path) -> Draw:
    """A folder of pictures as a camera: PNG, JPEG, TIFF, PGM, BMP, WebP."""
    valid = valid_pictures()
    views = [ViewConfig(name="a", x_steps=0.0, y_steps=0.0)]
    views += [ViewConfig(name="b", x_steps=1.0, y_steps=0.0)]
    path = folder / "a.png"
    path.write_bytes(valid[0][1])
    (folder / "b.png").write_bytes(valid[0][1])
    files = {"a": "a.png", "b": "b.png"}
    config = FolderCameraConfig(kind="folder", folder=str(folder), files=files)
    camera = FolderCamera(config, views, root=folder, clock=SystemClock())

    def draw(rng: random.Random) -> Read:
        kind, content = rng.choice(valid)
        path.write_bytes(changed(rng, kind, content))
        return _grab

    def _grab() -> object:
        with camera:
            return camera.grab(1.0)

    return draw


def recordings(folder: Path) -> Draw:
    """MCAP: of today, and the JSON of old in packed chunks."""
    path = folder / "r.mcap"
    valid = valid_recordings(folder)

    def draw(rng: random.Random) -> Read:
        path.write_bytes(changed_recording(rng, rng.choice(valid)))
        return lambda: list(recorded(path))

    return draw


def stage_lines(folder: Path) -> Draw:
    """What GRBL, Marlin, Zaber and a program of one's own say."""
    folder.mkdir(exist_ok=True)

    def draw(rng: random.Random) -> Read:
        kind = rng.choice([*STAGE_LINES, "answer", "settings"])
        if kind == "answer":
            line = rng.choice(ANSWERS)
            if rng.random() < 0.7:
                line = mutate.text(rng, line)
            return lambda: _answer(line)
        if kind == "settings":
            text = mutate.text(rng, SETTINGS)
            return lambda: read_axis(text.split("\n"), "X", device="stage")
        parse, lines = STAGE_LINES[kind]
        line = rng.choice(lines)
        if rng.random() < 0.9:
            line = mutate.text(rng, line)
        return lambda: parse(line)

    return draw


def _answer(line: str) -> object:
    try:
        return read_answer(line)
    except NoAnswerError as error:
        raise FormatError(str(error)) from error


def cells(folder: Path) -> Draw:
    """Cells and bytes of a database, as the verbs that look back read them."""
    database = Database(folder)

    def draw(rng: random.Random) -> Read:
        database.change(rng)
        return database.read

    return draw


SOURCES: Sequence[Source] = (
    Source("toml", profiles),
    Source("pfm", maps),
    Source("pictures", pictures),
    Source("mcap", recordings),
    *(Source(name, imports(name)) for name in FORMATS),
    Source("stage", stage_lines),
    Source("cells", cells, share=0.1),
)


def fresh(folder: Path) -> Path:
    """Return an empty folder at this place."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
