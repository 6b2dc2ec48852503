"""`rig export` and `rig import` as a user calls them."""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from rig.database import open_store
from rig.depth import write_pfm
from rig.errors import ConfigError
from rig.export.formats import FORMATS
from rig.export.geometry_format import geometry_format
from rig.export.samples import COLUMNS
from tests.support.command import Command
from tests.support.shared_data import SHARED
from tests.support.stores import sqlite_url
from tests.support.sweeps import stored_sweep

STEREO = SHARED / "checkerboard-stereo"


@pytest.fixture
def imported(rig: Command, tmp_path: Path) -> int:
    """A calibration of the simulated rig's five views, as Kalibr would tell it."""
    chain: list[str] = []
    places = {"centre": (0, 0), "left": (42.4, 0), "right": (-79.6, 0), "top": (37.2, 38.0),
              "bottom": (0.0, -81.2)}  # fmt: skip
    for n, (name, (x, y)) in enumerate(places.items()):
        chain += [
            f"cam{n}:",
            "  camera_model: pinhole",
            "  intrinsics: [610.0, 611.0, 320.5, 201.0]",
            "  distortion_model: radtan",
            "  distortion_coeffs: [-0.06, 0.02, 0.0004, -0.0003]",
            "  resolution: [640, 400]",
            f"  rostopic: /{name}/image_raw",
        ]
        if n:
            chain.append(
                f"  T_cn_cnm1: [[1, 0, 0, {x / 1000}], [0, 1, 0, {y / 1000}], [0, 0, 1, 0], "
                "[0, 0, 0, 1]]"
            )
    file = tmp_path / "camchain.yaml"
    file.write_text("\n".join(chain))
    answer = rig("import", "sim", file, "--format", "kalibr", "--json")
    assert answer.code == 0, answer.err
    return int(answer.json["calibration"])


@pytest.mark.parametrize("name", ["ros", "kalibr", "opencv", "mrcal", "colmap"])
def test_what_was_imported_can_be_exported_and_imported_again(
    rig: Command, imported: int, tmp_path: Path, name: str
) -> None:
    out = tmp_path / name
    answer = rig("export", imported, "--format", name, "--out", out, "--json")
    assert answer.code == 0, answer.err
    assert answer.json["gap_px"] < 1e-6
    again = rig("import", "sim", answer.json["out"], "--format", name, "--json")
    assert again.code == 0, again.err
    assert again.json["calibration"] == imported + 1


def test_depthai_needs_sockets(rig: Command, imported: int, tmp_path: Path) -> None:
    refused = rig("export", imported, "--format", "depthai", "--out", tmp_path / "d")
    assert refused.code == 1
    assert "--socket centre=CAM_A" in refused.err
    sockets = [
        f"--socket={view}=CAM_{letter}"
        for view, letter in zip(("centre", "left", "right", "top", "bottom"), "ABCDE", strict=True)
    ]
    answer = rig("export", imported, "--format", "depthai", "--out", tmp_path / "d", *sockets)
    assert answer.code == 0, answer.err
    assert (tmp_path / "d" / "calibration.json").exists()


def test_a_depth_map_becomes_points(rig: Command, imported: int, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    depth_mm = np.full((400, 640), 700.0, np.float32)
    depth_mm[:200] = np.nan
    write_pfm(tmp_path / "depth_00003.pfm", depth_mm)
    write_pfm(tmp_path / "sigma_00003.pfm", np.full((400, 640), 0.7, np.float32))
    out = tmp_path / "cloud.ply"
    answer = rig(
        "export", imported, "--format", "ply", "--capture", tmp_path, "--frame", 3, "--out", out,
        "--json",
    )  # fmt: skip
    assert answer.code == 0, answer.err
    assert answer.json["points"] == 200 * 640
    cloud = trimesh.load(out, process=False)
    points = np.asarray(cloud.vertices)
    assert points[:, 2] == pytest.approx(700.0, abs=1e-3)
    width_mm = 639 / 610.5 * 700.0
    assert np.ptp(points[:, 0]) == pytest.approx(width_mm, rel=0.01)
    assert points[:, 1].min() > -30.0


def test_a_map_of_another_size_is_refused(rig: Command, imported: int, tmp_path: Path) -> None:
    for kind in ("depth", "sigma"):
        write_pfm(tmp_path / f"{kind}_00000.pfm", np.ones((10, 10), np.float32))
    answer = rig("export", imported, "--format", "ply", "--capture", tmp_path)
    assert answer.code == 1
    assert "10 x 10 px" in answer.err


@pytest.mark.skipif(not STEREO.is_dir(), reason=f"not in {SHARED}; set RIG_SHARED_DATA")
def test_views_must_be_told_apart(rig: Command) -> None:
    refused = rig("import", "sim", STEREO, "--format", "opencv")
    assert refused.code == 1
    assert "--view left=centre" in refused.err


def test_mistakes_are_usage_errors(rig: Command) -> None:
    for arguments in (
        ("export", 1, "--format", "ply"),
        ("export", 1, "--format", "ros", "--socket", "a=CAM_A"),
        ("import", "sim", "x", "--format", "ros", "--view", "left"),
        ("export", 1, "--format", "nothing"),
    ):
        assert rig(*arguments).code == 2
    with open_store(os.environ["RIG_DATABASE"]):
        pass
    missing = rig("export", 7, "--format", "ros")
    assert missing.code == 1
    assert "calibration 7" in missing.err


@pytest.mark.slow
def test_the_samples_of_a_sweep_become_tables(rig: Command, tmp_path: Path) -> None:
    store, result = stored_sweep(tmp_path)
    sweep_id, stored = result.sweep_id, store.samples(result.sweep_id)
    slopes = [m.slope_px for m in store.measurements(sweep_id).values()]
    store.close()
    database = ("--db", sqlite_url(tmp_path))
    out = tmp_path / "sweep.csv"
    assert rig("export", sweep_id, "--format", "csv", "--out", out, *database).code == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert len(rows) == len(stored)
    assert tuple(rows[0]) == COLUMNS
    assert sorted(float(r["slope_px"]) for r in rows) == sorted(s for s in slopes if s is not None)
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `parquet` is missing")
    out = tmp_path / "sweep.parquet"
    assert rig("export", sweep_id, "--format", "parquet", "--out", out, *database).code == 0
    table = parquet.read_table(out).to_pydict()
    assert sorted(table["slope_px"]) == sorted(s for s in slopes if s is not None)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--format", "depthai", "--flash"), "--flash and --backup belong together"),
        (("--format", "depthai", "--backup", "b.json"), "--flash and --backup belong together"),
        (("--format", "ros", "--flash", "--backup", "b.json"), "go with depthai"),
        (("--format", "depthai", "--device", "1844"), "--device names the device to --flash"),
        (
            ("--format=depthai", "--flash", "--backup=b.json", "--device-json=d.json"),
            "omit --device-json",
        ),
    ],
)
def test_flashing_must_be_asked_for_completely(
    rig: Command, imported: int, options: tuple[str, ...], says: str
) -> None:
    answer = rig("export", imported, *options)
    assert answer.code == 2
    assert says in " ".join(answer.err.replace("│", " ").split())


@pytest.mark.slow
def test_flashing_without_a_device_writes_nothing(
    rig: Command, imported: int, tmp_path: Path
) -> None:
    out, backup = tmp_path / "d", tmp_path / "b.json"
    flash = ("--flash", "--backup", backup, "--device", "no-such-device")
    answer = rig("export", imported, "--format", "depthai", "--out", out, *flash)
    assert answer.code == 1
    assert "asked for no-such-device" in answer.err or "depthai is not installed" in answer.err
    assert not out.exists()
    assert not backup.exists()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("ros", "--socket", "a=CAM_A"), "--socket goes with depthai"),
        (("csv", "--refit"), "--refit goes with ros, kalibr, opencv, depthai, mrcal, colmap"),
        (("kalibr", "--frame", "0"), "--frame goes with ply"),
        (("ros", "--device-json", "x", "--capture", "y"), "goes with depthai; --capture goes with"),
        (("ply",), "--format ply: needs --capture"),
    ],
)
def test_an_option_of_another_format_is_refused_with_those_that_know_it(
    rig: Command, options: tuple[str, ...], says: str
) -> None:
    answer = rig("export", 1, "--format", *options)
    assert answer.code == 2
    assert says in " ".join(answer.err.split())


def test_every_format_of_the_table_can_be_loaded_and_is_offered() -> None:
    for name, entry in FORMATS.items():
        assert entry.name == name
        assert entry.exporter or entry.capture or entry.reader
        if entry.exporter:
            assert callable(entry.load().export)
        if entry.capture:
            assert callable(entry.load_capture().export)
        if entry.kind == "geometry":
            assert geometry_format(name).name == name
        else:
            with pytest.raises(ConfigError, match=r"those that hold one are ros, |holds captures"):
                geometry_format(name)
