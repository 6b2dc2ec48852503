"""A weak calibration on its way out and back in; lengths in another unit than the format's."""

import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from rig.database import open_store
from rig.errors import ConfigError, FormatError
from rig.export.formats import format_named, formats_of, written_formats
from rig.export.geometry_format import export_geometry, geometry_format
from rig.export.geometry_import import read_foreign
from rig.export.length_choice import CHOICES
from rig.export.lengths import in_unit, require_plausible
from rig.export.verdict import quality_of_import, read_weakness, weakness, write_weakness
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.profile.load import load_profile
from rig.records import StoredCalibration
from rig.stored import stored_geometry
from tests.support.command import Command
from tests.unit.export.test_geometry_import import geometry_of
from tests.unit.export.test_recognise import geometry

WEAK = "weak because all boards stood square-on; tilt some"
WRITTEN = [name for name in formats_of("geometry") if name in written_formats()]
PROFILE = load_profile("sim")
NAMES = tuple(view.name for view in PROFILE.views)


@pytest.mark.parametrize("name", WRITTEN)
def test_a_weak_calibration_says_so_in_its_files_and_back(tmp_path: Path, name: str) -> None:
    exported = export_geometry(geometry(), geometry_format(name), tmp_path, weak=WEAK)
    assert exported.weak == WEAK
    assert exported.gap_px < 1e-6
    back = read_foreign(exported.path)
    assert exported.tells_weak == (name != "depthai")  # JSON has no comments
    assert back.weak == (WEAK if exported.tells_weak else None)


@pytest.mark.parametrize("name", WRITTEN)
def test_a_good_calibration_says_nothing(tmp_path: Path, name: str) -> None:
    exported = export_geometry(geometry(), geometry_format(name), tmp_path)
    assert exported.weak is None
    assert read_foreign(exported.path).weak is None


def test_only_the_files_of_the_export_get_a_comment(tmp_path: Path) -> None:
    other = tmp_path / "notes.yml"
    other.write_text("mine: 1\n")
    export_geometry(geometry(), geometry_format("opencv"), tmp_path, weak=WEAK)
    assert other.read_text() == "mine: 1\n"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a: 1\n", "# rig: weak a b\na: 1\n"),
        ("%YAML:1.0\n---\na: 1\n", "%YAML:1.0\n---\n# rig: weak a b\na: 1\n"),
        ("%YAML 1.2\na: 1\n", "%YAML 1.2\n# rig: weak a b\na: 1\n"),
        ("", "# rig: weak a b\n"),
    ],
)
def test_the_comment_is_one_line_behind_directives(tmp_path: Path, before: str, after: str) -> None:
    file = tmp_path / "f.yaml"
    file.write_text(before)
    write_weakness([file], "weak a\n b")
    assert file.read_text() == after
    assert read_weakness(file, ("f.yaml",)) == "weak a b"
    assert read_weakness(tmp_path, ("{view}.yaml",)) == "weak a b"
    assert read_weakness(tmp_path, ("other.yaml",)) is None
    assert read_weakness(file, ()) is None


def test_a_verdict_from_a_file_is_bounded(tmp_path: Path) -> None:
    file = tmp_path / "f.yaml"
    file.write_bytes(b"# rig: weak " + b"\xff" * 3000)
    found = read_weakness(file, ("f.yaml",))
    assert found is not None
    assert len(found) == 2000


def test_what_is_stored_of_a_verdict() -> None:
    assert weakness({}) is None
    assert weakness({"good": True, "verdict": "good"}) is None
    assert weakness({"good": False, "verdict": WEAK}) == WEAK
    assert weakness({"good": False}) == "weak because of reasons that were not kept"
    assert weakness(quality_of_import("ros", Path("x"), WEAK)) == WEAK
    assert quality_of_import("ros", Path("x"), None) == {"imported": "ros", "from": "x"}


def chain(folder: Path, per_mm: float, comment: str = "") -> Path:
    """The simulated rig's five views at their places, as Kalibr would tell it."""
    lines = [comment]
    before = np.zeros(2)
    for number, view in enumerate(PROFILE.views):
        place = np.array([view.x_steps, view.y_steps]) * PROFILE.pitch_mm
        x, y = (before - place) * per_mm
        lines += [
            f"cam{number}:", "  camera_model: pinhole", "  intrinsics: [610, 611, 320, 201]",
            "  distortion_model: none", "  distortion_coeffs: []", "  resolution: [640, 400]",
            f"  rostopic: /{view.name}/image_raw",
            f"  T_cn_cnm1: [[1, 0, 0, {x:f}], [0, 1, 0, {y:f}], [0, 0, 1, 0], [0, 0, 0, 1]]",
        ]  # fmt: skip
        before = place
    file = folder / "chain.yaml"
    file.write_text("\n".join(lines))
    return file


@pytest.mark.slow
def test_a_weak_calibration_is_kept_but_not_taken_and_stays_weak(
    rig: Command, tmp_path: Path
) -> None:
    file = chain(tmp_path, 0.001, f"# rig: {WEAK}")
    answer = rig("import", "sim", file, "--json")
    assert answer.code == 3
    assert (answer.json["format"], answer.json["weak"]) == ("kalibr", WEAK)
    assert f"--calibration {answer.json['calibration']}" in answer.err
    with open_store(os.environ["RIG_DATABASE"]) as store:
        assert store.active_calibration("sim") is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "says", "code"),
    [("anipose", "the files say so in a comment", 3), ("depthai", "tell whoever gets it", 0)],
)
def test_a_weak_calibration_is_exported_with_a_warning(
    rig: Command, tmp_path: Path, name: str, says: str, code: int
) -> None:
    number = rig("import", "sim", chain(tmp_path, 0.001, f"# rig: {WEAK}"), "--json").json
    sockets = {"--socket": "ABCDE"} if name == "depthai" else {}
    named = [
        f"{option}={view}=CAM_{letter}"
        for option, letters in sockets.items()
        for view, letter in zip(NAMES, letters, strict=True)
    ]
    out = rig(
        "export", number["calibration"], "--format", name, "--out", tmp_path, "--json", *named
    )
    assert (out.code, out.json["weak"]) == (0, WEAK), out.err
    assert f"is {WEAK}; " in out.err
    assert says in out.err
    views = [
        f"--view=CAM_{letter}={view}" for view, letter in zip(NAMES, "ABCDE", strict=True)
    ] if named else []  # fmt: skip
    assert rig("import", "sim", out.json["out"], "--json", *views).code == code


@pytest.mark.slow
def test_lengths_in_another_unit_are_told_and_set_right(rig: Command, tmp_path: Path) -> None:
    file = chain(tmp_path, 1.0)  # mm, where the format has m
    refused = rig("import", "sim", file)
    assert refused.code == 1
    assert "mm apart" in refused.err
    assert "--lengths mm|cm|m|in" in refused.err
    answer = rig("import", "sim", file, "--lengths", "mm", "--json")
    assert (answer.code, answer.json["weak"]) == (0, None)


def spread(times: float) -> float:
    """How far apart the views of `sim` stand, mm."""
    places = [(view.x_steps, view.y_steps) for view in PROFILE.views]
    return times * PROFILE.pitch_mm * max(float(np.hypot(x, y)) for x, y in places)


@pytest.mark.parametrize("times", [1 / 2.9, 1.0, 2.9])
def test_lengths_of_a_rounded_profile_are_taken(times: float) -> None:
    require_plausible(two_apart(spread(times)), PROFILE)
    assert in_unit(two_apart(spread(times)), PROFILE, 1.0, "profile").centres_mm()[
        -1
    ] == pytest.approx([spread(1.0), 0.0, 0.0])


@pytest.mark.parametrize("times", [0.0, 1 / 3.1, 3.1, 1000.0])
def test_lengths_that_are_many_times_the_profiles_are_told_with_both(times: float) -> None:
    with pytest.raises(FormatError, match=f"apart, those of sim {spread(1.0):.4g} mm"):
        require_plausible(two_apart(spread(times)), PROFILE)


def two_apart(apart_mm: float) -> RigGeometry:
    told = geometry_of(NAMES, PROFILE.reference)
    here, there = Pose.identity(), Pose(np.eye(3), np.array([-apart_mm, 0.0, 0.0]))
    return replace(told, cam_from_reference=(*(here,) * (len(NAMES) - 1), there))


@pytest.mark.parametrize(
    ("unit", "times"), [("mm", 0.001), ("cm", 0.01), ("m", 1.0), ("in", 0.0254)]
)
def test_every_unit_has_its_length(unit: str, times: float) -> None:
    found = in_unit(two_apart(500.0), PROFILE, 1000.0, unit)
    assert found.centres_mm()[-1] == pytest.approx([500.0 * times, 0.0, 0.0])
    assert unit in CHOICES


def test_units_that_cannot_be_set_are_told() -> None:
    with pytest.raises(FormatError, match="the file tells its unit itself"):
        in_unit(two_apart(500.0), PROFILE, None, "mm")
    with pytest.raises(FormatError, match="stand at one place"):
        in_unit(two_apart(0.0), PROFILE, 1.0, "profile")


@pytest.mark.parametrize("name", ["caliscope", "zed"])
def test_formats_that_are_only_read_are_not_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match=f"format {name} asked to be written, it is only read"):
        export_geometry(geometry(), geometry_format(name), tmp_path)
    with pytest.raises(ConfigError, match="is only read here") as refused:
        format_named(name).load()
    assert "ros, kalibr" in refused.value.advice
    assert name not in written_formats()


def test_a_calibration_of_lenslets_is_told_as_one_that_no_format_holds() -> None:
    stored = StoredCalibration(
        7, "sim-lenslet", datetime(2026, 1, 1, tzinfo=UTC), {"lenslets": {}}, {}, {}, {}, {}, None,
        (10, 10), active=True,
    )  # fmt: skip
    with pytest.raises(ConfigError, match="cameras of calibration 7, it is one of lenslets"):
        stored_geometry(stored)
