"""An OAK that knows itself: depth of a profile without a database, a board or a stage."""

from pathlib import Path

import numpy as np
import pytest

import rig
from rig.database import open_store
from rig.errors import StoreError
from rig.factory import FactoryCalibrated
from rig.optics.factory import factory_geometry
from tests.support.geometry import true_geometry
from tests.support.oak import SMALL, OakRig
from tests.support.stores import sqlite_url

TURNED = "world.view_errors.right.rotation_deg=[0.2, -0.3, 0.1]"
KNOWN = (
    "world.eeprom=true",
    "world.renderer=analytic",
    "world.capture_scene=board",
    "slopes.range_mm=[700.0, 1100.0]",
    "quality.depth_sigma_pct=5.0",
    "quality.valid_share_pct=0.0",
    TURNED,
    *SMALL,
)


def test_the_simulated_eeprom_holds_the_true_cameras():
    truth = OakRig(("world.eeprom=true", TURNED))
    camera = truth.camera()
    assert isinstance(camera, FactoryCalibrated)
    known = camera.factory_calibration
    assert known is not None
    found = factory_geometry(truth.profile, known)
    wanted = true_geometry(truth.profile, truth.world.moment(0.0))
    for one, other in zip(found.cam_from_reference, wanted.cam_from_reference, strict=True):
        assert one.rotation == pytest.approx(other.rotation, abs=1e-6)
        assert one.translation_mm == pytest.approx(other.translation_mm, abs=1e-4)
    assert found.cameras[0].fx_px == pytest.approx(wanted.cameras[0].fx_px, rel=1e-6)
    assert OakRig().camera().factory_calibration is None


@pytest.fixture
def database(tmp_path: Path) -> str:
    """A database with nothing in it."""
    url = sqlite_url(tmp_path)
    open_store(url).close()
    return url


@pytest.mark.slow
def test_an_oak_gives_depth_by_its_own_calibration(database: str):
    camera = rig.open("sim-oak", database=database)
    assert camera.run.awaits == "depth"
    with rig.open("sim-oak", database=database, overrides=KNOWN) as known:
        frame = known.grab(20.0)
        assert known.run.curve is not None
        assert known.run.curve.source == "factory"
        assert known.run.notices[0].startswith("depth by the factory's calibration alone")
    # Switched on, the carriage stands 350 mm before machine zero; slopes of 700 to 1100 mm differ
    # by less than the period of the board.
    board = slice(42, 58), slice(66, 94)
    off = (frame.depth_mm[board] - 853.0) / frame.sigma_mm[board]
    answered = np.isfinite(off)
    assert answered.mean() > 0.9
    assert np.mean(np.abs(off[answered]) <= 2.0) > 0.93
    assert abs(np.median(frame.depth_mm[board][answered]) - 853.0) < 5.0
    assert np.nanmin(frame.depth_mm) >= 700.0
    assert np.nanmax(frame.depth_mm) <= 1100.0


@pytest.mark.slow
def test_an_oak_with_an_empty_eeprom_says_what_gives_depth(database: str):
    empty = ("world.eeprom=false", *KNOWN[1:])
    with (
        pytest.raises(StoreError, match="the device holds none of its own"),
        rig.open("sim-oak", database=database, overrides=empty),
    ):
        pass
