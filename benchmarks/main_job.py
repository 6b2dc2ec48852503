"""The main job as a user runs it: sweep the simulated rig, then measure depth with it.

`python -m benchmarks.main_job` prints, beside each goal, what was reached. Every number comes out
of the command line; only the truth they are compared with comes from the simulated World.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rig.depth import read_pfm
from rig.profile import Profile
from rig.profile.load import load_profile

BORDER_PX = 15
FRAMES = 5
DINO_THRESHOLD_PX = 0.07


@dataclass(frozen=True, slots=True)
class Run:
    """One command, finished."""

    answer: dict[str, Any]
    wall_s: float
    peak_mb: float


def run_rig(*arguments: str, folder: Path) -> Run:
    """Run `rig ARGUMENTS --json` with database and picture cache in a folder."""
    environment = {
        **os.environ,
        "RIG_DATABASE": f"sqlite:///{folder}/rig.sqlite",
        "RIG_CACHE_DIR": str(folder / "renders"),
    }
    log = folder / "usage.txt"
    command = [sys.executable, "-m", "benchmarks.resources", str(log), *arguments, "--json"]
    begun_s = time.monotonic()
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    wall_s = time.monotonic() - begun_s
    if done.returncode not in (0, 3):
        raise SystemExit(f"rig {' '.join(arguments)} ended with {done.returncode}: {done.stderr}")
    return Run(json.loads(done.stdout), wall_s, float(log.read_text()))


def show(what: str, found: str, goal: str) -> None:
    """Print one line of the table."""
    print(f"{what:64s} {found:>26s}   goal {goal}", flush=True)


def sweep_and_capture(folder: Path) -> None:
    """Sweep `sim`, capture `desk`, compare both with the World."""
    profile = load_profile("sim")
    sweep = run_rig("sweep", "sim", folder=folder)
    holdout, curve = sweep.answer["holdout"], sweep.answer["curve"]
    show("sim sweep: held-out distances, rms", f"{holdout['rms_pct']:.4f} %", "<= 0.05 %")
    show("sim sweep: held-out distances, largest", f"{holdout['max_pct']:.4f} %", "<= 0.1 %")
    focus_mm = _world_focus_mm(profile)
    show(
        "sim sweep: focus distance against the World's",
        f"{curve['focus_mm'] - focus_mm:+.3f} mm",
        "within 1 mm",
    )
    show("sim sweep: peak memory", f"{sweep.peak_mb:.0f} MB", "< 1500 MB")
    show("sim sweep: wall time, pictures not cached", f"{sweep.wall_s:.1f} s", "(make demo: 180 s)")
    capture = run_rig(
        "capture", "sim", "--frames", str(FRAMES), "--out", str(folder / "depth"), folder=folder
    )
    _judge_desk(profile, folder / "depth")
    show("desk capture: measuring, median", f"{capture.answer['measuring_ms']['p50']:.0f} ms", "-")
    show("desk capture: peak memory", f"{capture.peak_mb:.0f} MB", "< 1500 MB")
    again = run_rig("sweep", "sim", folder=folder)
    show("sim sweep: wall time, pictures cached", f"{again.wall_s:.1f} s", "(make demo: 60 s)")


def real_time_sweep(folder: Path) -> None:
    """Sweep with a stage that takes real time; pictures are cached by the sweep before."""
    sweep = run_rig("sweep", "sim", "--set", "world.clock=real", folder=folder)
    times = sweep.answer["times"]
    needed_s = times["moves_s"] + times["settling_s"] + times["exposures_s"]
    show(
        "sim sweep in real time: total / (moves + settling + exposures)",
        f"{times['total_s']:.1f} s / {needed_s:.1f} s = {times['total_s'] / needed_s:.3f}",
        "<= 1.15",
    )


def start_of_help(folder: Path) -> None:
    """Time `rig --help`."""
    walls_s: list[float] = []
    rig = Path(sys.executable).with_name("rig")
    for _ in range(7):
        begun_s = time.monotonic()
        subprocess.run([rig, "--help"], capture_output=True, check=True, cwd=folder)
        walls_s.append(time.monotonic() - begun_s)
    show("rig --help, median of 7", f"{statistics.median(walls_s):.2f} s", "< 0.4 s")


def dino(folder: Path) -> None:
    """Slopes of a public light field, where it is present, against its reference map."""
    data = Path(os.environ.get("RIG_SHARED_DATA", "../shared/data")).resolve() / "hci-dino"
    if not data.is_dir():
        print(f"hci-dino: left out, {data} is not there (RIG_SHARED_DATA names its folder)")
        return
    out = folder / "dino"
    run_rig(
        "capture", "hci-dino", "--slopes-only", "--set", f"camera.folder={data}",
        "--out", str(out), folder=folder,
    )  # fmt: skip
    slope_px = read_pfm(out / "slope_00000.pfm")
    error_px = np.abs(slope_px - read_pfm(data / "reference_subfocal.pfm"))
    inner = error_px[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]
    bad_pct = 100.0 * float(np.mean(~(inner <= DINO_THRESHOLD_PX)))
    show("hci-dino, 9 + 9 views: BadPix 0.07", f"{bad_pct:.2f} %", "<= 5 %")


def _world_focus_mm(profile: Profile) -> float:
    if profile.world is None:
        raise SystemExit("profile sim has no [world]")
    return profile.world.optics.focus_mm


def _judge_desk(profile: Profile, depth: Path) -> None:
    from rig_sim.bench import plugged_world  # noqa: PLC0415 truth, for this comparison only

    with plugged_world(profile, uses_stage=False) as world:
        truth_mm = world.true_depth_mm()
    errors: list[np.ndarray] = []
    shares: list[float] = []
    for number in range(FRAMES):
        depth_mm = read_pfm(depth / f"depth_{number:05d}.pfm")
        known = np.isfinite(depth_mm)
        shares.append(float(known.mean()))
        errors.append(np.abs(depth_mm[known] - truth_mm[known]) / truth_mm[known])
    error = np.concatenate(errors)
    near_mm, far_mm = 400.0, 1200.0
    inside = float(np.mean((truth_mm >= near_mm) & (truth_mm <= far_mm)))
    show("desk: median |error| of depth", f"{100 * np.median(error):.3f} %", "<= 0.3 %")
    show("desk: labelled pixels within 1 %", f"{100 * np.mean(error <= 0.01):.1f} %", ">= 90 %")
    show("desk: labelled share", f"{100 * statistics.fmean(shares):.1f} %", ">= 90 %")
    show("desk: true depth inside the swept range", f"{100 * inside:.1f} %", "-")


def main() -> None:
    """Run everything and print the table."""
    with tempfile.TemporaryDirectory(prefix="rig-benchmark-") as name:
        folder = Path(name)
        sweep_and_capture(folder)
        real_time_sweep(folder)
        dino(folder)
        start_of_help(folder)


if __name__ == "__main__":
    main()
