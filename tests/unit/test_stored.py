"""One run, looked up once: what a verb opens, who asks the store, and who is returned to."""

import json
import sys
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import cv2
import pytest

from rig.database import Store, open_store
from rig.errors import ConfigError, CurveError, StoreError
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.optics.calibrated import CalibratedOptics
from rig.optics.nominal import NominalOptics
from rig.profile import Profile
from rig.stored import (
    LENSLETS,
    curve_choice,
    find_curve,
    new_folder,
    open_run,
    run_of_sweep,
    stored_rig,
)
from tests.support.cameras import SmallRig
from tests.support.command import Command
from tests.support.geometry import true_geometry
from tests.support.stores import sqlite_url
from tests.support.sweeps import SCENE, SweepRecipe, bench_profile, stored_sweep

LOOKED_UP = ("calibration", "active_calibration", "curve", "active_curve")
"""What of the store belongs to a run."""
BENCH = ("name=bench", f"camera.width_px={SCENE.width}", f"camera.height_px={SCENE.height}")


@dataclass
class Trace:
    """The calls of one verb."""

    verb: str
    opened: int = 0
    askers: set[str] = field(default_factory=set[str])
    """Modules that asked the store for what belongs to a run."""
    called: list[str] = field(default_factory=list[str])
    """What of rig, outside the command line, the verb itself called, in this order."""

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        if event != "call" or frame.f_back is None:
            return
        module, name = frame.f_globals.get("__name__", ""), frame.f_code.co_name
        caller = frame.f_back.f_globals.get("__name__", "")
        if (module, name) == ("rig.database.schema", "open_engine"):
            self.opened += 1
        if module.startswith("rig.database.") and name in LOOKED_UP:
            self.askers.add(caller)
        of_verb = (caller, frame.f_back.f_code.co_name) == (f"rig.cli.{self.verb}", self.verb)
        is_named = not name.startswith("<")
        if of_verb and is_named and module.startswith("rig.") and ".cli" not in module:
            self.called.append(name)


@contextmanager
def traced(verb: str) -> Generator[Trace]:
    trace, before = Trace(verb), sys.getprofile()
    sys.setprofile(trace)
    try:
        yield trace
    finally:
        sys.setprofile(before)


@pytest.fixture
def shelf(tmp_path: Path) -> Path:
    """The rig of a stored sweep, its camera a folder of one drawn multi-view."""
    profile = bench_profile()
    store, _ = stored_sweep(tmp_path)
    with store:
        for frame in store.load(store.samples(1)[0]).frames:
            cv2.imwrite(str(tmp_path / f"{frame.view}.png"), frame.image)
    views = "\n".join(
        f'[[views]]\nname = "{view.name}"\nx_steps = {view.x_steps}\ny_steps = {view.y_steps}'
        for view in profile.views
    )
    files = "\n".join(f'{view.name} = "{view.name}.png"' for view in profile.views)
    path = tmp_path / "bench.toml"
    path.write_text(
        f'name = "bench"\npitch_mm = {profile.pitch_mm}\n{views}\n'
        f"[slopes]\nrange_px = [-12.0, 16.0]\n[quality]\nvalid_share_pct = 0.0\n"
        f'[camera]\nkind = "folder"\nfolder = "{tmp_path}"\n[camera.files]\n{files}\n'
    )
    return path


def calibrated(store: Store, profile: Profile | None = None, *, active: bool = False) -> int:
    """Store the true geometry of the simulated rig with faults as a calibration."""
    rig = SmallRig(name="sim-real", overrides=BENCH)
    geometry = true_geometry(rig.profile, rig.world.moment(0.0))
    return store.save_calibration(
        rig="bench",
        geometry=geometry_to_json(geometry),
        quality={},
        profile=(profile or rig.profile).model_dump(mode="json"),
        versions={},
        devices={},
        temperature_degc=None,
        image_size_px=(SCENE.width, SCENE.height),
        active=active,
    )


@pytest.mark.slow
def test_a_capture_opens_the_database_once_and_its_verb_only_prints(
    rig: Command, shelf: Path, tmp_path: Path
):
    with traced("capture") as trace:
        answer = rig("capture", shelf, "--frames", 1, "--db", sqlite_url(tmp_path), "--json")
    assert answer.code == 0, answer.err
    folder = Path(answer.json["out"])
    assert folder.parent == tmp_path / "captures"
    curve = answer.json["curve"]
    assert (curve["id"], curve["source"], curve["proven"]) == (1, "sweep 1", True)
    assert "alone" not in answer.err
    (line,) = (folder / "frames.jsonl").read_text().splitlines()
    assert json.loads(line)["curve_source"] == "sweep 1"
    assert trace.opened == 1
    assert trace.askers == {"rig.stored"}
    assert trace.called[0] == "load_profile"
    assert trace.called[-1] == "capture_on_rig"
    with open_store(sqlite_url(tmp_path)) as store:
        stored = store.active_curve("bench")
    assert answer.json["board_plane_rms_mm"] == stored.holdout["rms_mm"]
    assert answer.json["board_plane_rms_mm"] > 0.0
    assert answer.json["valid_mm"] == stored.curve["valid_mm"]


@pytest.mark.slow
def test_a_capture_by_a_calibration_alone_says_so(rig: Command, shelf: Path, tmp_path: Path):
    with open_store(sqlite_url(tmp_path / "other")) as store:
        number = calibrated(store, active=True)
    url = sqlite_url(tmp_path / "other")
    wide = ("--set", "slopes.range_mm=[300, 2000]", "--set", "quality.depth_sigma_pct=5")
    answer = rig("capture", shelf, "--frames", 1, "--db", url, "--json", *wide)
    assert answer.code == 0, answer.err
    said, *_ = answer.err.splitlines()
    assert said.startswith(f"depth by calibration {number} alone, not proven: +-")
    assert said.endswith("; `rig sweep bench` proves it")
    curve = answer.json["curve"]
    assert (curve["id"], curve["source"], curve["proven"]) == (None, f"calibration {number}", False)
    assert curve["valid_mm"][0] >= 300.0
    assert curve["valid_mm"][1] <= 2000.0
    plain = rig("capture", shelf, "--frames", 1, "--db", url, *wide)
    assert f"depth (the curve of calibration {number}, not proven: +-" in plain.out
    slopes = rig("capture", shelf, "--frames", 1, "--db", url, "--slopes-only", "--json", *wide)
    assert slopes.json["curve"] is None


@pytest.mark.slow
def test_a_check_opens_the_database_once_and_its_verb_only_prints(
    rig: Command, shelf: Path, tmp_path: Path
):
    with traced("check") as trace:
        answer = rig("check", shelf, "--db", sqlite_url(tmp_path), "--json")
    items = {item["item"]: item["status"] for item in answer.json["items"]}
    assert items["database"] == "pass"
    assert trace.opened == 1
    assert trace.askers == {"rig.stored"}
    verbs = [name for name in trace.called if name not in ("check_on_rig", "as_dict")]
    assert verbs == ["load_profile", "__init__", "worst"]


@pytest.mark.slow
def test_an_export_opens_the_database_once_and_its_verb_only_prints(rig: Command, tmp_path: Path):
    store, _ = stored_sweep(tmp_path)
    with store:
        number = calibrated(store)
    out = tmp_path / "ros"
    with traced("export") as trace:
        answer = rig(
            "export", number, "--format", "ros", "--out", out, "--db", sqlite_url(tmp_path)
        )
    assert answer.code == 0, answer.err
    assert trace.opened == 1
    assert trace.askers == {"rig.stored"}
    assert trace.called == ["exporter_for", "export_stored"]


def test_a_run_has_the_newest_good_curve_or_the_one_asked_for_or_none(tmp_path: Path):
    profile = bench_profile()
    store, result = stored_sweep(tmp_path)
    with store:
        newest = open_run(store, profile)
        assert isinstance(newest.optics, NominalOptics)
        assert newest.calibration is None
        assert newest.curve is not None
        assert (newest.curve.id, newest.curve.sweep_id) == (result.curve_id, result.sweep_id)
        assert newest.curve.curve.params == result.fit.best.params
        asked = open_run(store, profile, "none", result.curve_id)
        assert asked.curve is not None
        assert asked.curve.id == result.curve_id
        assert open_run(store, profile, None, "none").curve is None
        with pytest.raises(StoreError, match="asked for curve 99"):
            open_run(store, profile, None, 99)
        other = profile.model_copy(update={"pitch_mm": 41.0})
        with pytest.raises(CurveError, match="pitch_mm differs"):
            open_run(store, other)


def test_a_run_has_the_calibration_asked_for_and_a_curve_of_another_one_is_refused(tmp_path: Path):
    profile = bench_profile()
    store, _ = stored_sweep(tmp_path)
    with store:
        number = calibrated(store)
        run = open_run(store, profile, str(number), "none")
        assert isinstance(run.optics, CalibratedOptics)
        assert run.optics.calibration_id == number
        assert run.calibration == store.calibration(number)
        with pytest.raises(CurveError, match=f"run `rig fit 1 --calibration {number}`"):
            find_curve(store, run)
        with pytest.raises(ConfigError, match="give the number of a calibration, or none"):
            open_run(store, profile, "best")
        sweep = store.sweep(1)
        assert run_of_sweep(store, sweep).optics.calibration_id is None
        assert run_of_sweep(store, sweep, str(number)).optics.calibration_id == number
        assert stored_rig(store, number).geometry.names == run.optics.rectification.geometry.names


def test_cameras_of_a_calibration_of_lenslets_are_told_to_be_elsewhere(tmp_path: Path):
    store, _ = stored_sweep(tmp_path)
    with store:
        number = store.save_calibration(
            rig="box", geometry={LENSLETS: {}}, quality={}, profile={}, versions={}, devices={},
            temperature_degc=None, image_size_px=(220, 150), active=True,
        )  # fmt: skip
        with pytest.raises(ConfigError, match=r"it is one of lenslets.*sweep of box measured"):
            stored_rig(store, number)


def test_a_rig_whose_curve_missed_a_gate_has_none_by_itself(tmp_path: Path):
    store, result = stored_sweep(tmp_path, SweepRecipe(bend_px=0.5))
    with store:
        assert result.failed_gates
        with pytest.raises(StoreError, match=f"--curve {result.curve_id}"):
            open_run(store, bench_profile())
        assert open_run(store, bench_profile(), None, result.curve_id).curve is not None


def test_options_choose_a_curve_and_a_folder_lies_beside_the_database(tmp_path: Path):
    assert curve_choice(None, slopes_only=False) == "newest"
    assert curve_choice(0, slopes_only=False) == 0
    assert curve_choice(3, slopes_only=True) == "none"
    store, _ = stored_sweep(tmp_path)
    with store:
        folder = new_folder(store, "captures", "bench")
    assert folder.parent == tmp_path / "captures"
    assert folder.name.startswith("bench_20")
