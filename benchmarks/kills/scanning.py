"""Scans of `benchmarks.kills`: one camera on a slider, killed on its way from view to view."""

import json
from pathlib import Path

from benchmarks.kills.taking import SweepTrial
from benchmarks.kills.trial import PLAN, Trial
from benchmarks.program import Ended, run_program
from rig.live.captured import read_capture
from tests.support.small_scan import SMALL_SCAN, SWEPT_SCAN
from tests.support.small_sim import as_options
from tests.support.stores import sqlite_url

ROW = ("camera.row.at_mm=[-20.0, -9.0, 0.0, 12.5]", "quality.valid_share_pct=0.0")
STILL = ("world.lamp.drift_pct_per_min=0.0", "world.sensor.read_noise_levels=0.0",
         "world.sensor.electrons_per_level=1e30")  # fmt: skip

STEADY = "world.lamp.drift_pct_per_min=0.0"
SWEPT_STOPS = ("--at-mm", "400,500,650,800,900", "--samples", "1", "--calibration", "none")


def scan_words(folder: Path, *more: str) -> list[str]:
    """Return a small scan into a folder, from its beginning unless `more` says otherwise."""
    rig = ("capture", "sim-scan", *as_options((*SMALL_SCAN, *ROW, *STILL)), "--frames", "1")
    kept = ("--out", str(folder / "maps"), "--db", sqlite_url(folder))
    return [*rig, *more, "--slopes-only", "--calibration", "none", *kept]


def begun_scans(folder: Path) -> list[Path]:
    """Return the folders of all scans that have a plan."""
    return sorted(file.parent for file in (folder / "scans").glob("*/*/plan.json"))


def takes(folder: Path) -> dict[str, bytes]:
    """Return the content of every take that counts, picture and line."""
    found: dict[str, bytes] = {}
    for line in sorted((folder / "scans").glob("*/*/take_*.json")):
        for file in (line, line.with_suffix(".png")):
            found[str(file.relative_to(folder))] = file.read_bytes() if file.exists() else b""
    return found


def lost_in(folder: Path, ended: Ended) -> list[str]:
    """Go on with a scan that was killed, and look whether every take is still what it was.

    A kill may come before the scan has a plan: then there is nothing to resume.
    """
    if ended.code == 0:
        return []
    before = takes(folder)
    more = ("--resume",) if begun_scans(folder) else ()
    again = run_program(scan_words(folder, *more), folder)
    after = takes(folder)
    faults = [
        f"{name} is lost, or another one now" for name in before if after.get(name) != before[name]
    ]
    if again.code != 0:
        faults.append(f"it does not go on: {again.code}, {again.err[-400:]!r}")
    if len(begun_scans(folder)) != 1:
        faults.append(f"{len(begun_scans(folder))} scans were begun")
    return faults


def views_of(folder: Path) -> list[str]:
    """Return the names of the views that were taken."""
    lines = [json.loads(text) for name, text in takes(folder).items() if name.endswith("json")]
    return sorted({line["view"] for line in lines})


class ScanTrial(Trial):
    """`rig capture` with a camera on a slider, gone on with by `--resume`."""

    verb = "scan"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`: it begins with nothing."""

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return scan_words(folder)

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; `lost` has gone on already, a complete scan is given again."""
        return scan_words(folder, "--resume")

    def result(self, folder: Path) -> object:
        """The views that were taken, and the slopes of the light field."""
        (frame,) = read_capture(folder / "maps")
        return views_of(folder), bool((frame.label > 0).any())

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """See `Trial.lost`."""
        return lost_in(folder, ended)


class SweepScanTrial(SweepTrial):
    """`rig sweep` with a camera on a slider, gone on with by `--resume`.

    One sample is one scan: acknowledged whole, or taken anew from its first view.
    """

    verb = "sweep-scan"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`: it begins with nothing."""

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return [*self._rig(folder), *SWEPT_STOPS]

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`."""
        again = super().words_again(folder)
        if again[0] == "report":
            return again
        return [*self._rig(folder), "--resume"] if "--resume" in again else self.words(folder)

    def _rig(self, folder: Path) -> list[str]:
        return [
            "sweep",
            "sim-scan",
            *as_options((*SWEPT_SCAN, STEADY)),
            *PLAN,
            "--db",
            self.url(folder),
        ]
