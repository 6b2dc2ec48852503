from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rig.compare.comparison import distance_scores
from rig.compare.distances import NAMES, WITH_PLANE, BoardError, BoardErrors, compare_distances
from rig.curve import Curve
from rig.database import Store
from rig.optics.nominal import nominal_optics
from rig.stored import Run, RunCurve
from tests.support.sweeps import SweepRecipe, bench_profile, stored_sweep

RECIPE = SweepRecipe(
    distances_mm=(400.0, 470.0, 550.0, 640.0, 800.0, 1050.0),
    samples=2,
    holdout_every=0,
    fails_at_mm=(470.0,),
)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Store, Path]]:
    folder = tmp_path_factory.mktemp("sweep")
    with stored_sweep(folder, RECIPE)[0] as store:
        yield store, folder


@pytest.mark.slow
def test_the_board_of_a_sweep_is_measured_once_at_each_distance(store: tuple[Store, Path]):
    sweep = store[0]
    curve = Curve.from_json(sweep.curve(1).curve)
    told: list[int] = []
    boards = compare_distances(
        Run(bench_profile(), nominal_optics(bench_profile())),
        RunCurve(1, curve, sweep_id=1),
        sweep.samples(1),
        sweep.measurements(1),
        sweep.load,
        lambda done, _: told.append(done),
    )
    found_mm = [round(board.distance_mm) for board in boards]
    assert found_mm == [400, 550, 640, 800, 1050]  # no board at 470
    assert told == [1, 2, 3, 4, 5]
    for board in boards:
        assert tuple(board.errors) == NAMES
        low_px, high_px = board.window_px
        slope_px = float(curve.law.slope_px(np.array([board.distance_mm]))[0])
        assert low_px + 3.0 < slope_px < high_px - 3.0
        error = board.errors[WITH_PLANE]
        assert error.density_pct > 99.0  # the middle of a large square shows nothing
        assert abs(error.mean_mm) < 0.003 * board.distance_mm
    scores = {score.method: score for score in distance_scores(boards)}
    assert scores["rig"].bias_mm < 0.5 * scores["SGBM-HH"].bias_mm
    assert scores["rig"].spread_mm < 0.5 * scores["SGBM-HH"].spread_mm


def test_scores_are_what_they_say():
    good, none = BoardError(80.0, 3.0, 2.0, 5.0), BoardError(0.0, np.nan, np.nan, np.nan)
    far = BoardError(100.0, -4.0, 2.0, 7.0)
    boards = [
        BoardErrors(100.0, (0.0, 1.0), dict.fromkeys(NAMES, good)),
        BoardErrors(200.0, (0.0, 1.0), dict.fromkeys(NAMES, far)),
        BoardErrors(300.0, (0.0, 1.0), dict.fromkeys(NAMES, none)),
    ]
    score = distance_scores(boards)[0]
    assert score.bias_mm == pytest.approx(np.sqrt(12.5))
    assert score.bias_pct == pytest.approx(np.sqrt(6.5))
    assert score.worst_pct == pytest.approx(3.0)
    assert score.spread_mm == 6.0
    assert score.density_pct == 60.0
    unknown = distance_scores(boards[2:])[0]
    assert np.isnan(unknown.bias_mm)
    assert np.isnan(unknown.worst_pct)
    assert distance_scores([]) == ()
