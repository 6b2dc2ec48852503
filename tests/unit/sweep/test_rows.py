"""The rows of a rig from the samples of its sweep."""

from dataclasses import replace

import numpy as np
import pytest

from rig.measurement import Failure, Measurement
from rig.optics.nominal import nominal_optics
from rig.profile.load import load_profile
from rig.sweep.measure_sample import measure_sample
from rig.sweep.rows import rows_of_sweep
from tests.support.board_images import digitised
from tests.support.sweeps import SCENE

SIZE = (f"camera.width_px={SCENE.width}", f"camera.height_px={SCENE.height}")
PROFILE = load_profile("sim", (*SIZE, "slopes.range_px=[-9.0, 15.0]"))
OPTICS = nominal_optics(PROFILE)
NAMES = tuple(view.name for view in PROFILE.views)


def measured(distance_mm: float) -> Measurement:
    """The board with a bottom view that sees everything 1 px too far right."""
    rng = np.random.default_rng(int(distance_mm))
    scene = SCENE.with_changes(distance_mm=distance_mm)
    clean = [scene.clean(view.x_steps, view.y_steps) for view in PROFILE.views]
    bottom = NAMES.index("bottom")
    clean[bottom] = np.roll(clean[bottom], 1, axis=1)
    return measure_sample(
        PROFILE, OPTICS, np.stack([digitised(one, noise=1.0, rng=rng) for one in clean])
    )


@pytest.fixture(scope="module")
def samples() -> list[Measurement]:
    return [measured(distance_mm) for distance_mm in (450.0, 700.0, 1100.0)]


def test_the_view_whose_rows_miss_is_named(samples: list[Measurement]):
    rows = rows_of_sweep(samples, NAMES, OPTICS)
    assert rows is not None
    (line,) = rows.lines(NAMES)
    assert line.startswith("rows: bottom is 1.0 px too far right at the ")
    assert rows.rms_px[NAMES.index("bottom")] == pytest.approx(1.0, abs=0.02)
    assert rows.per_slope == pytest.approx(np.zeros(5), abs=2e-3)


def test_slopes_of_such_a_rig_are_those_of_a_faultless_one(samples: list[Measurement]):
    for distance_mm, one in zip((450.0, 700.0, 1100.0), samples, strict=True):
        truth_px = SCENE.with_changes(distance_mm=distance_mm).plane()[0]
        assert one.slope_px == pytest.approx(truth_px, abs=2e-3)  # 0.007 px off before


def test_a_view_that_did_not_see_the_board_is_unknown(samples: list[Measurement]):
    rows = rows_of_sweep([replace(samples[0], views=NAMES[:2])], NAMES, OPTICS)
    assert rows is not None
    assert [one is None for one in rows.fields] == [True, False, True, True, True]


def test_samples_of_an_older_version_tell_nothing(samples: list[Measurement]):
    older = [samples[0], replace(samples[1], across_px=None)]
    assert rows_of_sweep(older, NAMES, OPTICS) is None
    failed = Measurement(failure=Failure("not-found", "no board"))
    assert rows_of_sweep([failed], NAMES, OPTICS) is None
    assert rows_of_sweep([failed, samples[0]], NAMES, OPTICS) is not None
