"""A camera that moves against the row of cameras that it stands for: depth at held-out distances.

The standing row has the same views, the true geometry and steady light. The moved camera is
calibrated first, from pictures of its own; then it sweeps in steady and in drifting light. Pictures
are drawn in closed form; each sweep has its own noise. What is printed is the rms error at
held-out distances, pooled over the seeds, and its ratio to the standing row's with the scatter that
chance gives such a ratio.

With a folder the run keeps what it has, and the same command goes on with it.

Run: python -m benchmarks.moved_camera [--full] [--seeds 4] [--folder DIR] [--sweeps 6]
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rig.profile import Profile
from rig.profile.load import load_profile, parse_profile
from rig.profile.toml_text import toml_text

ALIKE = (
    "world.renderer=analytic",
    "sweep.holdout_every=2",
    "sweep.backward_every=0",
    "quality.holdout_rms_pct=1.0",
    "quality.holdout_max_pct=1.0",
)
FULL = ("sweep.count=17",)
"""The profile's own 640 x 400, eight distances held out."""
SMALL = (
    "sweep.count=13",
    "camera.inner.width_px=320",
    "camera.inner.height_px=200",
    "world.optics.focal_px=305.0",
    "world.optics.blur_px=0.6",
    "slopes.range_px=[3.5,18.0]",
)
STEADY = "world.lamp.drift_pct_per_min=0.0"
_SPACING_MM, _GOLDEN = 46.0, 0.618034
_DRAWS = 2000


def standing(moved: Profile) -> Profile:
    """The row of cameras with the views of a moved one; its sensors are shifted, as a row's are."""
    data = moved.model_dump(mode="json", exclude_none=True)
    data["name"] = "standing"
    data["camera"] = data["camera"]["inner"]
    del data["stages"], data["world"]["slider"]
    data["world"]["lamp"]["drift_pct_per_min"] = 0.0
    # The sensors of a row are shifted: slopes are 0 at the focus distance.
    at_focus = data["world"]["optics"]["focal_px"] * data["pitch_mm"]
    at_focus /= data["world"]["optics"]["focus_mm"]
    data["slopes"] = {"range_px": [m - at_focus for m in data["slopes"]["range_px"]]}
    return parse_profile(data, source="the standing row")


def rig(database: Path, *words: str) -> dict[str, Any]:
    """Run one verb and return what it prints."""
    command = [sys.executable, "-m", "rig", *words, "--db", f"sqlite:///{database}", "--json"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode not in (0, 3):
        raise SystemExit(ended.stderr)
    return json.loads(ended.stdout)


def sets(*overrides: str) -> list[str]:
    return [word for override in overrides for word in ("--set", override)]


def rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def ratio_of(one: Sequence[float], other: Sequence[float]) -> tuple[float, float, float]:
    """Return the ratio of two rms, and where 95 % of it lie by chance (bootstrap over sweeps)."""
    draw = np.random.default_rng(1)
    drawn = [
        rms(draw.choice(one, len(one)).tolist()) / rms(draw.choice(other, len(other)).tolist())
        for _ in range(_DRAWS)
    ]
    low, high = np.quantile(drawn, [0.025, 0.975]).tolist()
    return rms(one) / rms(other), low, high


def of_seed(seed: int) -> tuple[str, ...]:
    """Noise and distances of one sweep.

    A board at one distance falls onto the pixels in one way. What that does to its edges, some
    thousandths of a pixel, is the same in every noise: so each seed has distances of its own.
    """
    shift_mm = _SPACING_MM * ((seed * _GOLDEN) % 1.0 - 0.5)
    return (
        f"world.seed={seed}",
        f"sweep.from_mm={425.0 + shift_mm:.1f}",
        f"sweep.to_mm={1175.0 + shift_mm:.1f}",
    )


def run(folder: Path, asked: argparse.Namespace) -> None:
    """Sweep what is not swept yet, at most as often as asked; print all there is."""
    profile = (*ALIKE, *(FULL if asked.full else SMALL))
    database, row = folder / "rig.sqlite", folder / "standing.toml"
    notes = folder / "errors.json"
    row.write_text(toml_text(standing(load_profile("sim-scan", profile))))
    if not (folder / "calibrated").exists():
        found = rig(
            database, "calibrate", "sim-scan", *sets(*profile), "--pictures", str(asked.pictures)
        )
        print(json.dumps(found["sliders"]["lines"]), "calibration", found["verdict"]["good"])
        (folder / "calibrated").touch()
    kinds = {
        "standing": (str(row), "--calibration", "none"),
        "moved, steady light": ("sim-scan", "--calibration", "1", *sets(*profile, STEADY)),
        "moved, drifting light": ("sim-scan", "--calibration", "1", *sets(*profile)),
    }
    errors: dict[str, dict[str, float]] = json.loads(notes.read_text()) if notes.exists() else {}
    todo = [(str(seed), kind) for seed in range(1, asked.seeds + 1) for kind in kinds]
    todo = [(seed, kind) for seed, kind in todo if seed not in errors.get(kind, {})]
    for seed, kind in todo[: asked.sweeps]:
        swept = rig(database, "sweep", *kinds[kind], *sets(*of_seed(int(seed))))
        errors.setdefault(kind, {})[seed] = swept["holdout"]["rms_pct"]
        notes.write_text(json.dumps(errors))
    base = list(errors.get("standing", {}).values())
    for kind, by_seed in errors.items():
        own = list(by_seed.values())
        ratio, low, high = ratio_of(own, base)
        print(
            f"{kind}: rms {rms(own):.5f} % of the distance over {len(own)} sweeps, "
            f"{ratio:.2f} times the standing row's ({low:.2f}-{high:.2f})",
            [round(error, 5) for error in own],
        )
    print(f"{max(len(todo) - asked.sweeps, 0)} sweeps left")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="640 x 400 and eight distances")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--pictures", type=int, default=25)
    parser.add_argument("--folder", type=Path, help="keeps what was swept")
    parser.add_argument("--sweeps", type=int, default=1000, help="at most as many in this run")
    asked = parser.parse_args(arguments)
    if asked.folder is not None:
        asked.folder.mkdir(parents=True, exist_ok=True)
        run(asked.folder, asked)
        return
    with tempfile.TemporaryDirectory() as folder:
        run(Path(folder), asked)


if __name__ == "__main__":
    main()
