"""A folder of pictures compared from end to end: files, page and numbers."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import typer
from rig_drivers.stored.folder import FolderCamera

from rig.cli.compare import compare
from rig.compare.compare import CompareRequest, compare_methods
from rig.compare.frames import METHODS, compare_frames
from rig.database import open_store
from rig.devices import SystemClock
from rig.errors import ConfigError, SlopeError, StoreError
from rig.optics.nominal import nominal_optics
from rig.profile import FolderCameraConfig
from rig.profile.load import load_profile
from rig.stored import Run
from tests.support.lightfield import (
    Surface,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
)
from tests.support.stores import STOPS, sqlite_url

SHAPE = (96, 128)
PLACES = {"middle": (0.0, 0.0), "left": (-1.06, 0.0), "right": (0.93, 0.0), "below": (0.0, 1.02)}


@pytest.fixture(scope="session")
def pictures() -> np.ndarray:
    """Two multi-views (2, V, H, W) of a disc before a wall."""
    x, y = np.array(list(PLACES.values())).T
    near = noise_texture(3, mean=150.0, contrast=35.0, finest_px=2.5)
    far = noise_texture(5, mean=90.0, contrast=30.0, finest_px=2.5)
    scene = [
        Surface(plane(-1.3), far, everywhere),
        Surface(plane(3.2), near, disc((60.0, 45.0), 25.0)),
    ]
    views = render_views(scene, SHAPE, x, y, 2)
    return np.stack([expose(views, noise=1.0, seed=seed) for seed in (1, 2)])


@pytest.fixture
def profile_file(tmp_path: Path, pictures: np.ndarray) -> Path:
    """A rig of stored pictures whose description tries to be HTML."""
    for place, name in enumerate(PLACES):
        for number, multiview in enumerate(pictures):
            cv2.imwrite(str(tmp_path / f"{name}_{number}.png"), multiview[place])
    files = "\n".join(f'{name} = "{name}_*.png"' for name in PLACES)
    views = "\n".join(
        f'[[views]]\nname = "{name}"\nx_steps = {x}\ny_steps = {y}'
        for name, (x, y) in PLACES.items()
    )
    path = tmp_path / "shelf.toml"
    path.write_text(
        f'name = "shelf"\ndescription = "<b>bold</b> & loud"\npitch_mm = 40.0\n{views}\n'
        f"[slopes]\nrange_px = [-4.0, 6.0]\n"
        f'[camera]\nkind = "folder"\nfolder = "{tmp_path}"\n[camera.files]\n{files}\n'
    )
    return path


@dataclass(frozen=True)
class Compared:
    numbers: dict[str, Any]
    printed: str
    html: str


@pytest.fixture
def compared(profile_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Compared:
    out = tmp_path / "out"
    database = f"sqlite:///{tmp_path / 'rig.sqlite'}"
    compare(str(profile_file), frames=2, slopes_only=True, out=out, database=database, as_json=True)
    numbers = json.loads((out / "compare.json").read_text())
    return Compared(numbers, capsys.readouterr().out, (out / "compare.html").read_text())


@pytest.mark.slow
def test_slopes_of_stored_pictures_are_compared(compared: Compared):
    numbers = compared.numbers
    assert json.loads(compared.printed) == numbers
    assert (numbers["rig"], numbers["curve"], numbers["sweep"]) == ("shelf", None, None)
    assert numbers["distances"] == numbers["summary"] == []
    frames = numbers["frames"]
    assert (frames["count"], frames["size_px"]) == (2, [128, 96])
    assert (frames["partner"], frames["baseline_steps"]) == ("left", 1.06)
    assert frames["disparities_px"][0] <= -4.24
    assert frames["disparities_px"][1] >= 6.36
    methods = {score["method"]: score for score in frames["methods"]}
    assert list(methods) == [method.name for method in METHODS]
    assert methods["rig"]["agreement_pct"] == 100.0
    for name, score in methods.items():
        assert 30.0 < score["density_pct"] <= 100.0, name
        assert score["agreement_pct"] > 80.0, name
        assert score["duration_ms"] > 0.0
    assert methods["SGBM-HH filled"]["density_pct"] == 100.0

    # The page needs nothing else, and text of users is text.
    html = compared.html
    links = re.findall(r'\b(?:src|href|srcset|data|action)="([^"]*)"', html)
    assert [link for link in links if not link.startswith(("#", "data:image/png;"))] == []
    assert "<script" not in html
    assert not re.search(r"@import|url\((?!#)", html)
    assert "&lt;b&gt;bold&lt;/b&gt; &amp; loud" in html
    assert "<b>" not in html
    for name in methods:
        assert f"<td>{name}</td>" in html


def test_a_table_is_printed_and_a_folder_found_beside_the_database(
    profile_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    database = f"sqlite:///{tmp_path / 'bench' / 'rig.sqlite'}"
    compare(str(profile_file), slopes_only=True, database=database)
    printed = capsys.readouterr().out
    assert "1 multi-view; matchers use the reference view and left, 1.06 view steps" in printed
    assert all(method.name in printed for method in METHODS)
    (page,) = (tmp_path / "bench" / "comparisons").glob("shelf_*/compare.html")
    assert str(page) in printed


def test_without_a_curve_a_sweep_is_asked_for(profile_file: Path, tmp_path: Path):
    with pytest.raises(StoreError, match="rig sweep"):
        compare(str(profile_file), database=f"sqlite:///{tmp_path / 'rig.sqlite'}")


def test_a_sweep_has_no_place_in_a_comparison_of_slopes(profile_file: Path):
    with pytest.raises(typer.BadParameter, match="neither --curve nor --sweep"):
        compare(str(profile_file), slopes_only=True, sweep_id=1)


def test_the_sweep_of_another_rig_is_refused(profile_file: Path, tmp_path: Path):
    shelf = load_profile(str(profile_file))
    assert isinstance(shelf.camera, FolderCameraConfig)
    camera = FolderCamera(shelf.camera, shelf.views, root=tmp_path, clock=SystemClock())
    moved = load_profile(str(profile_file), ["views.left.x_steps=-1.0"])
    with open_store(sqlite_url(tmp_path)) as store:
        sweep_id = store.create_sweep(
            rig="shelf",
            profile=moved.model_dump(mode="json"),
            stops=STOPS,
            samples_per_stop=1,
            versions={},
            devices={},
        )
        request = CompareRequest(frames=1, sweep_id=sweep_id, folder=tmp_path / "out")
        with pytest.raises(ConfigError, match="sweep 1 of rig shelf: views differs"):
            compare_methods(
                Run(shelf, nominal_optics(shelf)), request, camera, store, lambda *_: None
            )


def test_no_multiviews_are_no_comparison():
    profile = load_profile("sim")
    with pytest.raises(SlopeError, match="none came whose views lie within"):
        compare_frames(Run(profile, nominal_optics(profile)), [])


def test_a_folder_that_cannot_be_made_is_named(profile_file: Path, tmp_path: Path):
    (tmp_path / "taken").write_text("")
    database = f"sqlite:///{tmp_path / 'rig.sqlite'}"
    with pytest.raises(StoreError, match="taken/out: cannot be made"):
        compare(
            str(profile_file), slopes_only=True, out=tmp_path / "taken" / "out", database=database
        )
