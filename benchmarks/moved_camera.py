"""A camera that moves against the row of cameras that it stands for: depth at held-out distances.

The standing row has the same views, the true geometry and steady light. The moved camera is
calibrated first, from pictures of its own; then it sweeps in steady and in drifting light. Pictures
of 320 x 200, drawn in closed form; each sweep has its own noise.

Run: python -m benchmarks.moved_camera [--seeds 4] [--pictures 25]
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

from rig.profile import Profile
from rig.profile.load import load_profile, parse_profile
from rig.profile.toml_text import toml_text

SMALL = (
    "world.renderer=analytic",
    "camera.inner.width_px=320",
    "camera.inner.height_px=200",
    "world.optics.focal_px=305.0",
    "world.optics.blur_px=0.6",
    "slopes.range_px=[3.5,18.0]",
    "sweep.count=13",
    "sweep.holdout_every=2",
    "sweep.backward_every=0",
    "quality.holdout_rms_pct=1.0",
    "quality.holdout_max_pct=1.0",
)
STEADY = "world.lamp.drift_pct_per_min=0.0"


def standing(moved: Profile) -> Profile:
    """The row of cameras with the views of a moved one; its sensors are shifted, as a row's are."""
    data = moved.model_dump(mode="json", exclude_none=True)
    data["name"] = "standing"
    data["camera"] = data["camera"]["inner"]
    del data["stages"], data["world"]["slider"]
    data["world"]["lamp"]["drift_pct_per_min"] = 0.0
    data["slopes"] = {"range_px": [-5.0, 7.5]}
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


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--pictures", type=int, default=25)
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        database, file = Path(folder) / "rig.sqlite", Path(folder) / "standing.toml"
        file.write_text(toml_text(standing(load_profile("sim-scan", SMALL))))
        found = rig(
            database, "calibrate", "sim-scan", *sets(*SMALL), "--pictures", str(asked.pictures)
        )
        print(json.dumps(found["sliders"]["lines"]), "calibration", found["verdict"]["good"])
        kinds = {
            "standing": (str(file), "--calibration", "none"),
            "moved, steady light": ("sim-scan", "--calibration", "1", *sets(*SMALL, STEADY)),
            "moved, drifting light": ("sim-scan", "--calibration", "1", *sets(*SMALL)),
        }
        for kind, words in kinds.items():
            errors: list[float] = []
            for seed in range(1, asked.seeds + 1):
                holdout = rig(database, "sweep", *words, *sets(f"world.seed={seed}"))["holdout"]
                errors.append(holdout["rms_pct"])
            print(f"{kind}: rms {rms(errors):.4f} % of the distance at held-out distances", errors)


if __name__ == "__main__":
    main()
