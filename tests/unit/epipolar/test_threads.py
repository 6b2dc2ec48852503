"""The same bits on any number of threads: how rows are shared must not show."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar import RectifiedViews, SlopeMap, SlopePrior, estimate_slopes
from tests.unit.epipolar.conftest import SHAPE, X_STEPS, Y_STEPS, Scene, texture


def dense() -> tuple[RectifiedViews, tuple[float, float]]:
    """A row of seven views of a tilted wall, exactly resampled in closed form."""
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(float)
    x_steps = np.arange(-3.0, 4.0)
    grey = texture(5, 120.0)
    images = [grey(columns + (0.4 + 0.01 * rows) * x, rows) for x in x_steps]
    frames = np.clip(np.rint(images), 0, 255).astype(np.uint8)
    return RectifiedViews(frames, x_steps, np.zeros(7), 3), (-1.0, 2.0)


def sparse(ball: Scene) -> tuple[RectifiedViews, tuple[float, float]]:
    return ball.views, (-20.0, 25.0)


def pair(ball: Scene) -> tuple[RectifiedViews, tuple[float, float]]:
    return RectifiedViews(ball.views.images[1:3], X_STEPS[1:3], Y_STEPS[1:3], 0), ball.range_px


def frames(views: RectifiedViews, range_px: tuple[float, float]) -> list[SlopeMap]:
    """An exhaustive search, and frames that follow it, one for each turn."""
    found = [estimate_slopes(views, range_px)]
    views = replace(views, mending=found[0].mending)
    for _ in range(4):
        last = found[-1]
        prior = SlopePrior(last.slope_px, np.maximum(last.sigma_px, np.float32(0.2)), last.steady)
        found.append(estimate_slopes(views, range_px, prior))
    return found


@pytest.mark.parametrize("kind", ["dense", "sparse", "pair"])
def test_any_number_of_threads_gives_the_same_bits(
    kind: str, ball: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = {"dense": dense(), "sparse": sparse(ball), "pair": pair(ball)}[kind]
    bits: set[bytes] = set()
    for count in (1, 2, 3, 8):
        monkeypatch.setenv("RIG_THREADS", str(count))
        found = frames(*given)
        maps = (m for one in found for m in (one.slope_px, one.sigma_px, one.label))
        bits.add(b"".join(m.tobytes() for m in maps))
    assert len(bits) == 1
