"""Kalibr's target files, into a profile and onto paper."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.errors import FormatError, OptionError, RigError
from rig.export.kalibr_target import read_target
from rig.optics.target import target_of
from rig.profile import AprilGridConfig, AsymmetricCirclesConfig, CheckerboardConfig
from rig.profile.load import load_profile
from tests.support.command import Command

# As the pages of Kalibr show them, quotes and comments too.
APRILGRID = """\
target_type: 'aprilgrid' #gridtype
tagCols: 6               #number of apriltags
tagRows: 5               #number of apriltags
tagSize: 0.0299          #size of apriltag, edge to edge [m]
tagSpacing: 0.3          #ratio of space between tags to tagSize
"""
CHECKERBOARD = """\
target_type: 'checkerboard' #gridtype
targetCols: 7               #number of internal chessboard corners
targetRows: 6               #number of internal chessboard corners
rowSpacingMeters: 0.06      #size of one chessboard square [m]
colSpacingMeters: 0.06      #size of one chessboard square [m]
"""
CIRCLES = """\
target_type: 'circlegrid' #gridtype
targetCols: 4             #number of circles (cols)
targetRows: 11            #number of circles (rows)
spacingMeters: 0.02       #distance between circles [m]
asymmetricGrid: True      #use asymmetric grid (opencv) [bool]
"""
READ = settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)


def written(folder: Path, text: str) -> Path:
    path = folder / "target.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_each_kind_is_read_in_mm(tmp_path: Path) -> None:
    assert read_target(written(tmp_path, APRILGRID)) == AprilGridConfig(
        kind="aprilgrid", tag_columns=6, tag_rows=5, tag_mm=29.9, spacing=0.3
    )
    assert read_target(written(tmp_path, CHECKERBOARD)) == CheckerboardConfig(
        kind="checkerboard", columns=7, rows=6, square_mm=60.0
    )
    assert read_target(written(tmp_path, CIRCLES), 15.0) == AsymmetricCirclesConfig(
        kind="asymmetric_circles", columns=4, rows=11, spacing_mm=20.0, diameter_mm=15.0
    )


def test_circles_stand_where_kalibr_has_them(tmp_path: Path) -> None:
    """Kalibr: x = (2 c + r mod 2) spacing, y = r spacing, all from a point of one's choice."""
    points_mm = target_of(read_target(written(tmp_path, CIRCLES), 15.0)).points_mm.reshape(-1, 3)
    wanted_mm = [((2 * c + r % 2) * 20.0, r * 20.0) for r in range(11) for c in range(4)]
    found_mm = points_mm[:, :2] - points_mm[0, :2]
    assert found_mm == pytest.approx(np.array(wanted_mm))


def test_tags_lie_as_far_apart_as_kalibr_says(tmp_path: Path) -> None:
    points_mm = target_of(read_target(written(tmp_path, APRILGRID))).points_mm.reshape(10, 12, 3)
    across_mm = points_mm[0, :, 0] - points_mm[0, 0, 0]
    wanted_mm = [29.9 * 1.3 * (i // 2) + 29.9 * (i % 2) for i in range(12)]
    assert across_mm == pytest.approx(np.array(wanted_mm))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[1, 2]", "expected named fields"),
        ("tagCols: 6\n", "has no target_type"),
        ("target_type: 'charuco'\n", "target_type is charuco, of Kalibr's there are aprilgrid"),
        (APRILGRID.replace("tagRows", "tagLines"), "tagLines is no field of Kalibr's aprilgrid"),
        (APRILGRID + "tagStartId: 36\n", "tagStartId is no field"),
        (APRILGRID.replace("tagCols: 6", ""), "has no tagCols"),
        (APRILGRID.replace("0.0299", "29.9"), r"tagSize is 29.9 m, expected .* at most 5 m"),
        (APRILGRID.replace("0.0299", "-0.1"), r"tagSize is -0.1 m"),
        (APRILGRID.replace("0.0299", "'0.03'"), "tagSize: expected finite numbers"),
        (APRILGRID.replace("tagCols: 6", "tagCols: 6.5"), "tagCols is 6.5, expected a whole"),
        (APRILGRID.replace("tagCols: 6", "tagCols: 600"), "target.tag_columns: must be at most"),
        (APRILGRID.replace("0.3 ", "1.3 "), "target.spacing: must be at most 1"),
        (CHECKERBOARD.replace("colSpacingMeters: 0.06", "colSpacingMeters: 0.05"), "50 mm wide"),
        (CIRCLES.replace("True", "False"), "stand in a plain grid"),
        (CIRCLES.replace("True", "1"), "asymmetricGrid must be True or False"),
    ],
)
def test_what_is_no_such_target_is_refused(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(FormatError, match=told) as caught:
        read_target(written(tmp_path, text))
    assert "target.yaml" in caught.value.found


def test_a_diameter_belongs_to_circles(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="tells no diameter"):
        read_target(written(tmp_path, CIRCLES))
    with pytest.raises(OptionError, match="asked for circles of 15 mm"):
        read_target(written(tmp_path, APRILGRID), 15.0)


@READ
@given(
    st.integers(1, 100), st.integers(1, 100), st.floats(1e-4, 5.0), st.floats(0.01, 1.0),
    st.booleans(),
)  # fmt: skip
def test_every_grid_of_tags_comes_back(
    tmp_path: Path, columns: int, rows: int, size_m: float, spacing: float, flow: bool
) -> None:
    fields = {
        "target_type": "aprilgrid",
        "tagCols": columns,
        "tagRows": rows,
        "tagSize": size_m,
        "tagSpacing": spacing,
    }
    found = read_target(written(tmp_path, yaml.safe_dump(fields, default_flow_style=flow)))
    assert isinstance(found, AprilGridConfig)
    assert (found.tag_columns, found.tag_rows, found.spacing) == (columns, rows, spacing)
    assert found.tag_mm == pytest.approx(1000.0 * size_m, rel=1e-11)


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)
_NAMES = st.sampled_from(
    [
        "tagCols", "tagRows", "tagSize", "tagSpacing", "targetCols", "targetRows",
        "rowSpacingMeters", "colSpacingMeters", "spacingMeters", "asymmetricGrid",
    ]
)  # fmt: skip


@READ
@given(
    st.sampled_from([APRILGRID, CHECKERBOARD, CIRCLES]),
    st.dictionaries(_NAMES, _VALUES, max_size=3),
)
def test_odd_values_are_read_or_refused(
    tmp_path: Path, text: str, changed: dict[str, object]
) -> None:
    fields = {**yaml.safe_load(text), **changed}
    diameter_mm = 15.0 if text is CIRCLES else None
    try:
        target_of(read_target(written(tmp_path, yaml.safe_dump(fields)), diameter_mm))
    except RigError as error:
        assert len(str(error)) < 1500


@READ
@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "any.yaml"
    path.write_bytes(f"target_type: aprilgrid\n{text}".encode("utf-8", "replace"))
    with pytest.raises(FormatError):
        read_target(path)


@pytest.mark.parametrize(
    "bomb",
    [
        "tagCols: " + "[" * 5000,
        "tagCols: " + "9" * 401,
        "tagCols: 190:20:30",
        "a: &a [1, 1]\nb: &b {<<: {c: *a}}\ntagCols: *b",
        "tagCols: [" + "1, " * 20_000 + "1]",
    ],
)
def test_bombs_are_refused(tmp_path: Path, bomb: str) -> None:
    with pytest.raises(FormatError, match="is no YAML"):
        read_target(written(tmp_path, f"target_type: aprilgrid\n{bomb}\n"))


def test_a_new_profile_and_a_sheet_take_it(rig: Command, tmp_path: Path) -> None:
    file, profile = written(tmp_path, APRILGRID), tmp_path / "bench.toml"
    made = rig(
        "profile", "new", "bench", "--camera", "v4l2", "--views", 2, "--stage", "none",
        "--target", file, "--out", profile,
    )  # fmt: skip
    assert made.code == 0, made.err
    assert load_profile(str(profile)).target == read_target(file)
    board = ("--page", "a3", "--out")
    drawn = rig("target", "--from", file, *board, tmp_path / "from-file.svg")
    assert drawn.code == 0, drawn.err
    assert rig("target", profile, *board, tmp_path / "from-profile.svg").code == 0
    sheets = [(tmp_path / f"from-{name}.svg").read_text() for name in ("file", "profile")]
    assert sheets[0] == sheets[1]
    circles = tmp_path / "circles.yaml"
    circles.write_text(CIRCLES)
    sheet = tmp_path / "circles.svg"
    refused = rig("target", "--from", circles, *board, sheet)
    assert (refused.code, sheet.exists()) == (2, False)
    assert "--diameter-mm" in refused.err
    assert rig("target", "--from", circles, "--diameter-mm", 15, *board, sheet).code == 0
    assert rig("target", "--from", file, "--kind", "charuco", *board, sheet).code == 2


def test_a_new_profile_says_which_options_go_together(rig: Command, tmp_path: Path) -> None:
    file, out = written(tmp_path, APRILGRID), ("--out", tmp_path / "x.toml")
    assert rig("profile", "new", "x", "--from", "sim", "--target", file, *out).code == 2
    assert rig("profile", "new", "x", "--diameter-mm", 15, *out).code == 2


def test_it_is_told_from_a_calibration(rig: Command, tmp_path: Path) -> None:
    refused = rig("import", "sim", written(tmp_path, APRILGRID))
    assert refused.code == 1
    assert "a target of Kalibr, no calibration" in refused.err
    assert "rig profile new NAME --target FILE" in refused.err
