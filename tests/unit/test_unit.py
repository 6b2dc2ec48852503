"""Several rigs of one name: none takes the curve or the calibration of another by itself."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from rig.database.tables import CurveRow, SweepRow
from rig.errors import CurveError, StoreError
from rig.profile.load import load_profile
from rig.run import Run
from rig.unit import unit_of
from tests.support.kept_stores import CONCLUDED, kept_store

OAK = load_profile("oak-d")


@pytest.mark.parametrize(
    ("serial", "unit"),
    [
        ("14442C10D13F7FD000", "14442C10D13F7FD000"),
        ("A1, B2", "A1, B2"),
        ("/dev/v4l/by-id/usb-cam_17-video-index0", "/dev/v4l/by-id/usb-cam_17-video-index0"),
        ("/dev/v4l/by-path/pci-0000", ""),
        ("/dev/video0, A1", ""),
        ("A1, ", ""),
        ("", ""),
    ],
)
def test_a_unit_is_what_its_camera_says_of_itself(serial: str, unit: str):
    assert unit_of(OAK, {"serial": serial}) == unit
    assert (
        unit_of(OAK.model_copy(update={"unit": "left bench"}), {"serial": serial}) == "left bench"
    )


def test_pictures_do_not_tell_which_camera_took_them():
    assert unit_of(load_profile("sim"), {"serial": "sim"}) == ""
    assert unit_of(OAK, {}) == ""


def run(unit: str, **by_itself: str) -> Run:
    profile = OAK.model_copy(update={"unit": unit})
    named = tuple((what.replace("_", " "), other) for what, other in by_itself.items())
    return Run(profile, optics=None, by_itself=named)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("unit", "serial", "is_refused"),
    [
        ("", "B2", True), ("B2", "A1", True), ("", "A1", False), ("A1", "x", False),
        ("", "", False),
    ],
)  # fmt: skip
def test_what_is_of_another_unit_is_refused(unit: str, serial: str, is_refused: bool):
    identity: Mapping[str, str] = {"serial": serial}
    used = run(unit, calibration_3="", curve_7="A1")
    if not is_refused:
        used.require_unit(identity)
        assert used.by_itself[1] == ("curve 7", "A1")
        return
    with pytest.raises(CurveError, match="curve 7 of rig oak-d is of unit A1, this one is B2") as e:
        used.require_unit(identity)
    assert 'unit = "B2"' in e.value.advice
    assert "--curve 7" in e.value.advice


def test_what_nobody_named_is_refused_for_nobody():
    used = run("B2", calibration_3="", curve_7="")
    used.require_unit({})
    with pytest.raises(CurveError, match=r"calibration 4 .* take this one on purpose with --calib"):
        replace(used, by_itself=(("calibration 4", "A1"),)).require_unit({})


def test_the_newest_of_the_own_unit_is_found(tmp_path: Path):
    with kept_store(tmp_path) as store:
        for unit in ("A1", "B2", "A1"):
            with store._writing("test") as session:
                row = session.get(SweepRow, CONCLUDED)
                assert row is not None
                row.unit = unit
            store.save_curve(CONCLUDED, curve={"of": unit}, holdout={}, versions={})
        assert store.active_curve("bench").id == 4
        assert [store.active_curve("bench", unit).id for unit in ("A1", "B2")] == [4, 3]
        assert store.curve(3).unit == "B2"
        assert store.active_curve("bench", "C3").id == 1  # of no named unit
        assert store.has_curve("bench", "C3")
        assert not store.has_curve("desk", "A1")
        with store._writing("test") as session:
            session.query(CurveRow).filter(CurveRow.unit == "").delete()
        assert not store.has_curve("bench", "C3")
        with pytest.raises(
            StoreError, match="asked for the curve of unit C3 of rig bench, the newest, 4, is of "
            "unit A1; make one with rig sweep, or take that one on purpose with --curve 4",
        ):  # fmt: skip
            store.active_curve("bench", "C3")


def test_calibrations_belong_to_a_unit_as_well(tmp_path: Path):
    with kept_store(tmp_path) as store:
        first = store.calibration(1)
        numbers = [
            store.save_calibration(
                rig="bench", geometry={}, quality={}, profile={}, versions={}, devices={},
                temperature_degc=None, image_size_px=(4, 3), unit=unit, note="night",
            )
            for unit in ("A1", "B2")
        ]  # fmt: skip
        assert (first.unit, first.note) == ("", "")
        stored = store.calibration(numbers[1])
        assert (stored.unit, stored.note) == ("B2", "night")
        assert stored.provenance.host != ""
        found = [store.active_calibration("bench", unit) for unit in ("A1", "B2", "C3", "")]
        assert [c and c.id for c in found] == [*numbers, 1, numbers[1]]
