"""The scenes stay what they were when figures were measured on them.

`scenes.json` holds them as they are: every thing on the desk with its place, material, size and
seed, and coarse means of every material. `written()` makes its content anew where a scene is
changed on purpose; then the figures of the docs have to be measured anew too.
"""

import json
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig_sim.scenes import materials
from rig_sim.scenes.bench import bench_surfaces
from rig_sim.scenes.desk import desk_things
from rig_sim.scenes.light import Thing, illuminate
from rig_sim.scenes.place import ball, rectangle, tube
from rig_sim.textures import fractal

FILE = Path(__file__).with_name("scenes.json")
SIZE = (96, 80)
SAMPLES: dict[str, materials.Recipe] = {
    "plain": materials.plain(SIZE, 1, level=0.4),
    "plain, coarse": materials.plain(SIZE, 1, level=0.3, grain=0.06),
    "wallpaper": materials.wallpaper(SIZE, 2, period=20),
    "wood": materials.wood(SIZE, 3, boards=3),
    "print_page": materials.print_page((240, 160), 4, line=8),
    "print_page, words only": materials.print_page((180, 160), 5, line=9, picture=0.0),
    "photograph": materials.photograph(SIZE, 6),
    "map_sheet": materials.map_sheet(SIZE, 7),
    "glaze": materials.glaze(SIZE, 8),
    "leaf": materials.leaf(SIZE, 9),
    "lacquer": materials.lacquer(SIZE, 10, level=0.5, stripes=4),
}


def of_thing(thing: Thing) -> dict[str, Any]:
    recipe = thing.reflectance
    assert isinstance(recipe, partial)
    return {
        "kind": thing.shape.kind,
        "matrix": np.round(thing.shape.world_from_unit[:3], 6).tolist(),
        "material": recipe.func.__name__,
        "size and seed": [list(recipe.args[0]), *recipe.args[1:]],
        "choices": recipe.keywords,
    }


def means(texture: np.ndarray) -> list[list[float]]:
    """Means of four by four parts; they depend on every texel."""
    rows, columns = (size // 4 for size in texture.shape)
    parts = texture[: 4 * rows, : 4 * columns].astype(float).reshape(4, rows, 4, columns)
    return np.round(parts.mean(axis=(1, 3)), 6).tolist()


def lit() -> list[list[list[float]]]:
    """Means of the light on three things that stand in each other's light."""
    white = np.ones((16, 16), np.float32)
    shapes = (
        rectangle((0.0, 150.0, 900.0), (300.0, 0.0, 60.0), (20.0, 10.0, -200.0)),
        ball((-60.0, 80.0, 850.0), 70.0, tilt_deg=20.0),
        tube((90.0, 150.0, 800.0), (110.0, -40.0, 830.0), 20.0),
    )
    return [means(one.texture) for one in illuminate([Thing(s, lambda: white) for s in shapes])]


def written() -> dict[str, Any]:
    return {
        "desk": [of_thing(thing) for thing in desk_things()],
        "bench": [
            [
                surface.shape.kind,
                np.round(surface.shape.world_from_unit[:3], 6).tolist(),
                *means(surface.texture),
            ]
            for surface in bench_surfaces()
        ],
        "lit": lit(),
        "materials": {name: means(recipe()) for name, recipe in SAMPLES.items()},
    }


@cache
def stored() -> dict[str, Any]:
    return json.loads(FILE.read_text())


def test_every_thing_of_the_desk_is_where_it_was_and_made_of_what_it_was():
    there = [of_thing(thing) for thing in desk_things()]
    assert len(there) == len(stored()["desk"])
    for thing, was in zip(there, stored()["desk"], strict=True):
        assert np.array(thing.pop("matrix")) == pytest.approx(np.array(was["matrix"]), abs=2e-6)
        assert thing == {key: value for key, value in was.items() if key != "matrix"}


def test_wall_and_bench_are_what_they_were():
    for surface, (kind, matrix, *parts) in zip(bench_surfaces(), stored()["bench"], strict=True):
        assert surface.shape.kind == kind
        assert surface.shape.world_from_unit[:3] == pytest.approx(np.array(matrix), abs=2e-6)
        assert np.array(means(surface.texture)) == pytest.approx(np.array(parts), abs=2e-5)


def test_light_and_shadow_fall_where_they_fell():
    assert np.array(lit()) == pytest.approx(np.array(stored()["lit"]), abs=2e-5)


@pytest.mark.parametrize("name", SAMPLES)
def test_a_material_looks_as_it_did(name: str):
    texture = SAMPLES[name]()
    assert texture.dtype == np.float32
    assert np.array(means(texture)) == pytest.approx(
        np.array(stored()["materials"][name]), abs=2e-5
    )


@pytest.mark.parametrize("name", SAMPLES)
def test_a_material_reflects_no_more_than_paper_and_no_less_than_ink(name: str):
    texture = SAMPLES[name]()
    assert 0.05 <= texture.min() < texture.max() <= 0.85
    assert texture.std() > 0.01


def test_ink_and_paper_end_what_a_material_asks_for():
    dark = materials.plain(SIZE, 1, level=-1.0)()
    bright = materials.plain(SIZE, 1, level=2.0)()
    assert np.all(dark == np.float32(0.05))
    assert np.all(bright == np.float32(0.85))


@pytest.mark.parametrize("fall", [0.0, 1.0, 1.7])
def test_the_amplitude_of_a_fractal_falls_as_told(fall: float):
    grain = fractal((256, 256), 5, fall=fall)
    assert grain.mean() == pytest.approx(0.0, abs=1e-5)
    assert grain.std() == pytest.approx(1.0, abs=1e-5)
    power = np.abs(np.fft.fft2(grain)) ** 2
    frequency = np.hypot(np.fft.fftfreq(256)[:, None], np.fft.fftfreq(256)[None, :])
    rings = [(low, 1.25 * low) for low in (0.02, 0.05, 0.1, 0.2, 0.4)]
    levels = [np.mean(power[(frequency >= a) & (frequency < b)]) for a, b in rings]
    slope = np.polyfit(np.log([a for a, _ in rings]), np.log(levels), 1)[0]
    assert slope == pytest.approx(-2.0 * fall, abs=0.1)
