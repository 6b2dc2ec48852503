"""Verbs that take pictures or measure them: sweep, fit, calibrate, capture."""

import json
from pathlib import Path

from benchmarks.kills.trial import OPTIONS, Trial, curve_of, sweep_words, swept
from benchmarks.program import Ended
from rig.database import open_store
from rig.errors import RigError
from rig.live.captured import read_capture
from rig.store.verify import verify
from tests.support.stores import sqlite_url

FRAMES = 4
PICTURES = 6
HAND = ("--set", "world.renderer=analytic", "--set", "world.hand.hold_s=0.7",
        "--set", "world.hand.move_s=0.05")  # fmt: skip
_EMPTY = "holds no whole multi-view"


class SweepTrial(Trial):
    """`rig sweep`, gone on with by `--resume`."""

    verb = "sweep"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        del folder
        swept()

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return sweep_words(self.url(folder))

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; a sweep that has no row yet begins anew."""
        with open_store(self.url(folder)) as store:
            rows = store.sweeps()
        if not rows:
            return sweep_words(self.url(folder))
        if rows[-1].state == "concluded":
            return ["report", str(rows[-1].id), "--db", self.url(folder)]
        return sweep_words(self.url(folder), "--resume")

    def result(self, folder: Path) -> object:
        """Curve, samples and state; a second curve is one too many."""
        with open_store(self.url(folder)) as store:
            rows = store.sweeps()
            curves = [row.curve_id is not None for row in rows]  # a server's numbers have gaps
            return ([row.state for row in rows], [row.samples for row in rows], curves,
                    curve_of(self.url(folder), rows[-1].id))  # fmt: skip

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """See `Trial.lost`."""
        with open_store(self.url(folder)) as store:
            there = {
                f"{row.id} {sample.stop.index} {sample.number}"
                for row in store.sweeps()
                for sample in store.samples(row.id)
            }
            damage = [str(finding) for finding in verify(store).damage]
        return [
            *(f"{key} was acknowledged and is lost" for key in set(ended.stored) - there),
            *damage,
        ]


class FitTrial(Trial):
    """`rig fit`, again."""

    verb = "fit"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["fit", "1", "--db", sqlite_url(folder)]

    def result(self, folder: Path) -> object:
        """The newest curve, which is that of the sweep itself."""
        with open_store(sqlite_url(folder)) as store:
            return store.sweep(1).state, len(store.measurements(1)), curve_of(sqlite_url(folder), 1)


class CalibrateTrial(Trial):
    """`rig calibrate`, gone on with by `--resume`."""

    verb = "calibrate"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        del folder

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        pictures = ("--pictures", str(PICTURES), "--lens", "none", "--db", sqlite_url(folder))
        return ["calibrate", "sim", *OPTIONS, *HAND, *pictures]

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; where no picture was kept it begins anew."""
        albums = [p for p in (folder / "frames" / "sim").glob("calibration_*") if p.is_dir()]
        if any((album / "calibration.json").exists() for album in albums):
            return ["history", "--db", sqlite_url(folder)]
        return [*self.words(folder), *(["--resume"] if albums else [])]

    def result(self, folder: Path) -> object:
        """How many calibrations there are, of how many pictures."""
        with open_store(sqlite_url(folder)) as store:
            return [row.rig for row in store.calibrations()]

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """See `Trial.lost`."""
        there: set[str] = set()
        for album in (folder / "frames" / "sim").glob("calibration_*"):
            file = album / "pictures.jsonl"
            lines = file.read_text().splitlines() if file.exists() else []
            there |= {f"{album.name} {json.loads(line)['number']}" for line in lines}
        return [f"{key} was acknowledged and is lost" for key in set(ended.stored) - there]


class CaptureTrial(Trial):
    """`rig capture` with a recording; another one into a new folder."""

    verb = "capture"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return self._into(folder, "one")

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`."""
        return self._into(folder, "two")

    def _into(self, folder: Path, name: str) -> list[str]:
        out = ("--out", str(folder / name), "--record", str(folder / f"{name}.mcap"))
        count = ("--frames", str(FRAMES), "--curve", "1", "--db", sqlite_url(folder))
        board = ("--set", "world.capture_scene=board")
        return ["capture", "sim", *OPTIONS, *board, *count, *out]

    def result(self, folder: Path) -> object:
        """How many frames the capture that came to its end has, by both of its outputs."""
        name = "two" if (folder / "two").exists() else "one"
        sources = (folder / name, folder / f"{name}.mcap")
        return [sum(1 for _ in read_capture(source)) for source in sources]

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """What was written can be read: every whole frame in the folder, and the recording."""
        del ended
        faults: list[str] = []
        for source in (folder / "one", folder / "one.mcap"):
            if not source.exists() or (source.is_dir() and not (source / "frames.jsonl").exists()):
                continue
            try:
                for frame in read_capture(source):
                    _ = frame.slope_px if source.is_dir() else frame.views
            except RigError as error:
                if _EMPTY not in error.found:  # killed before a frame was whole
                    faults.append(f"{source.name} cannot be read: {error}")
        return faults
