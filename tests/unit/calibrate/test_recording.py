"""`rig calibrate` on a recording: its pictures are read, no camera waits for a target in a hand."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from rig.calibrate.calibrate import CalibrateRequest, run_calibration
from rig.calibrate.solve import SolveChoices
from rig.calibrate.take import Operator
from rig.database import open_store
from rig.errors import ConfigError
from rig.frames import Frame, MultiView
from rig.interrupts import Interrupts
from rig.profile import Profile, RecordingCameraConfig
from rig.recording import RecordingWriter
from tests.support.board_images import BoardScene, digitised
from tests.support.stores import sqlite_url
from tests.support.sweeps import SCENE, bench_profile

POSES = tuple(
    SCENE.with_changes(distance_mm=distance_mm, tilt_deg=tilt_deg)
    for distance_mm, tilt_deg in product(
        (420.0, 520.0), ((25.0, 0.0, 0.0), (-25.0, 0.0, 5.0), (0.0, 25.0, 0.0), (0.0, -25.0, -5.0))
    )
)


def recorded_rig(file: Path, poses: tuple[BoardScene, ...]) -> Profile:
    """A rig of three views whose camera is a recording of a drawn board in some poses."""
    bench = bench_profile()
    views = bench.views[:3]
    with RecordingWriter(file, [view.name for view in views], {"kind": "drawn"}) as writer:
        for number, scene in enumerate(poses):
            writer.write(
                MultiView(
                    tuple(
                        Frame(view.name, drawn(scene, number, view.x_steps, view.y_steps), 1.0, 1)
                        for view in views
                    )
                ),
                time_ns=number,
            )
    camera = RecordingCameraConfig(kind="recording", file=str(file))
    changes = {"views": views, "camera": camera, "stage": None, "world": None}
    return bench.model_copy(update=changes)


def drawn(scene: BoardScene, number: int, x_steps: float, y_steps: float) -> np.ndarray:
    clean = scene.clean(x_steps, y_steps)
    return digitised(clean, noise=1.0, rng=np.random.default_rng(number))


@pytest.mark.slow
def test_every_picture_of_a_recording_is_read_and_solved(tmp_path: Path) -> None:
    profile = recorded_rig(tmp_path / "board.mcap", POSES)
    told: list[str] = []
    with open_store(sqlite_url(tmp_path)) as store, Interrupts() as interrupts:
        operator = Operator(interrupts, lambda *_: None, told.append)
        request = CalibrateRequest(profile, SolveChoices(lens="none"))
        result = run_calibration(request, store, operator)
        stored = store.calibration(result.calibration_id)
    assert not any("in your hand" in line for line in told)
    assert result.tally.found == [len(POSES)] * 3
    assert result.calibration.pictures == tuple(range(len(POSES)))
    assert stored.devices["camera"] == {
        "kind": "recording",
        "model": "recorded images",
        "serial": str(tmp_path / "board.mcap"),
    }
    camera = result.calibration.geometry.cameras[0]
    assert camera.fx_px == pytest.approx(SCENE.focal_px, rel=0.02)
    assert not list(result.file.parent.glob("picture_*"))  # a recording is not copied
    assert result.report.stat().st_size > 10_000


@pytest.mark.parametrize("wish", ["resume", "on_stage"])
def test_a_recording_knows_no_stage_and_is_never_resumed(tmp_path: Path, wish: str) -> None:
    profile = recorded_rig(tmp_path / "board.mcap", POSES[:1])
    stage = bench_profile().stage
    profile = profile.model_copy(update={"stage": stage})
    request = replace(CalibrateRequest(profile), **{wish: True})
    with open_store(sqlite_url(tmp_path)) as store, Interrupts() as interrupts:
        operator = Operator(interrupts, lambda *_: None, lambda _: None)
        with pytest.raises(ConfigError, match="leave out --resume and --stage"):
            run_calibration(request, store, operator)
