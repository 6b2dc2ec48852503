import logging
import os
from pathlib import Path

import numpy as np
import pytest
from rig_sim.cache import PictureCache, cache_folder
from rig_sim.pictures import CachedRenderer
from rig_sim.render_analytic import AnalyticRenderer
from rig_sim.world import Moment

from tests.support.cameras import SMALL, SmallRig

KEY = "ab" + "0" * 62
SHAPES = [(8, 10)] * 3


def stack(seed: int = 1) -> list[np.ndarray]:
    return list(np.random.default_rng(seed).random((3, 8, 10), np.float32))


class CountingRenderer(AnalyticRenderer):
    def __init__(self) -> None:
        self.rendered = 0

    def render(self, moment: Moment) -> tuple[np.ndarray, ...]:
        self.rendered += 1
        return super().render(moment)


def test_a_stored_stack_comes_back_as_it_was_stored(tmp_path: Path):
    cache = PictureCache(tmp_path)
    stored = cache.store(KEY, stack())
    again = cache.load(KEY, SHAPES)
    assert again is not None
    np.testing.assert_array_equal(again, stored)
    np.testing.assert_allclose(again, stack(), atol=0.5 / 65535)
    assert cache.load("cd" + KEY[2:], SHAPES) is None


def test_pictures_of_different_sizes_come_back_each_at_its_own(tmp_path: Path):
    shapes = [(8, 10), (5, 20), (9, 3)]
    pictures = [np.random.default_rng(1).random(shape, np.float32) for shape in shapes]
    cache = PictureCache(tmp_path)
    cache.store(KEY, pictures)
    again = cache.load(KEY, shapes)
    assert again is not None
    assert [one.shape for one in again] == shapes
    for one, picture in zip(again, pictures, strict=True):
        np.testing.assert_allclose(one, picture, atol=0.5 / 65535)


def test_a_broken_file_is_no_picture(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    cache = PictureCache(tmp_path)
    cache.store(KEY, stack())
    (path,) = tmp_path.rglob("*.png")
    for broken in (path.read_bytes()[:-40], b"", b"no picture"):
        path.write_bytes(broken)
        assert cache.load(KEY, SHAPES) is None
    assert "broken" in caplog.text


def test_a_stack_of_another_size_is_no_picture(tmp_path: Path):
    cache = PictureCache(tmp_path)
    cache.store(KEY, stack())
    assert cache.load(KEY, [(8, 11)] * 3) is None


def test_the_longest_unused_pictures_go_first(tmp_path: Path):
    size = _size_of_one(tmp_path / "probe")
    cache = PictureCache(tmp_path / "held", largest_bytes=int(3.5 * size))
    keys = [f"{number:02}" + "0" * 62 for number in range(4)]
    for age, key in enumerate(keys[:3]):
        cache.store(key, stack())
        os.utime(tmp_path / "held" / key[:2] / f"{key}.png", (age, age))
    assert cache.load(keys[0], SHAPES) is not None  # used just now
    cache.store(keys[3], stack())
    left = [cache.load(key, SHAPES) is not None for key in keys]
    assert left == [True, False, False, True]


def test_a_folder_that_cannot_be_written_costs_one_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    cache = PictureCache(blocked)
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            np.testing.assert_allclose(cache.store(KEY, stack()), stack(), atol=0.5 / 65535)
    assert caplog.text.count("cannot be written") == 1
    assert "RIG_CACHE_DIR" in caplog.text


def test_no_half_written_files_are_left(tmp_path: Path):
    PictureCache(tmp_path).store(KEY, stack())
    assert [path.suffix for path in tmp_path.rglob("*") if path.is_file()] == [".png"]


def test_a_moment_is_rendered_once_even_by_two_renderers(tmp_path: Path):
    rig = SmallRig(SMALL)
    first, second = CountingRenderer(), CountingRenderer()
    one = CachedRenderer(first, PictureCache(tmp_path)).render(rig.world.moment(0.0))
    two = CachedRenderer(second, PictureCache(tmp_path)).render(rig.world.moment(0.0))
    assert (first.rendered, second.rendered) == (1, 0)
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(
    "override",
    ["world.optics.focal_px=153.0", "world.board_margin_mm=16.0", "camera.width_px=158"],
)
def test_another_camera_or_board_is_another_picture(tmp_path: Path, override: str):
    renderer = CountingRenderer()
    cached = CachedRenderer(renderer, PictureCache(tmp_path))
    cached.render(SmallRig(SMALL).world.moment(0.0))
    cached.render(SmallRig((*SMALL, override)).world.moment(0.0))
    assert renderer.rendered == 2


def test_the_folder_is_the_users_choice(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    monkeypatch.delenv("RIG_CACHE_DIR", raising=False)
    assert cache_folder() == Path("/somewhere/epirig/renders")
    monkeypatch.setenv("RIG_CACHE_DIR", "/else")
    assert cache_folder() == Path("/else")


def _size_of_one(folder: Path) -> int:
    PictureCache(folder).store(KEY, stack())
    (path,) = folder.rglob("*.png")
    return path.stat().st_size
