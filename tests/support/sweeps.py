"""Finished sweeps in a store, made in closed form: pictures, slopes and curve without a bench."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.database import Store, open_store, software_versions
from rig.frames import Frame, MultiView
from rig.measurement import Failure, Measurement, Point
from rig.plan import Stop, plan_stops
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.records import SampleKey
from rig.sweep.conclude import SweepResult, conclude_sweep
from tests.support.board_images import BoardScene, digitised

SCENE = BoardScene(width=320, height=200, focal_px=305.0)
NEAR_TO_FAR_MM = (400.0, 470.0, 550.0, 640.0, 700.0, 800.0, 920.0, 1050.0, 1200.0)


@dataclass(frozen=True)
class SweepRecipe:
    """What a sweep should look like."""

    distances_mm: tuple[float, ...] = NEAR_TO_FAR_MM
    samples: int = 2
    holdout_every: int = 4
    backward_every: int = 4
    overrides: tuple[str, ...] = ()
    """Of the profile."""
    noise_px: float = 0.002
    """Standard deviation of the slope of one sample."""
    bend_px: float = 0.0
    """Largest departure of the measured slopes from the physical law, at the focus distance."""
    fails_at_mm: tuple[float, ...] = ()
    """Distances at which no board is found."""
    rise_degc: float = 0.0
    """Warming over the whole sweep."""
    note: str = ""


def stored_sweep(folder: Path, recipe: SweepRecipe | None = None) -> tuple[Store, SweepResult]:
    """Store a whole sweep below `folder` and conclude it."""
    recipe = recipe or SweepRecipe()
    profile = bench_profile(recipe.overrides)
    stops = plan_stops(
        recipe.distances_mm,
        holdout_every=recipe.holdout_every,
        backward_every=recipe.backward_every,
        travel_mm=(300.0, 1300.0),
        stage="stage",
    )
    store = open_store(f"sqlite:///{folder / 'rig.sqlite'}")
    sweep_id = store.create_sweep(
        rig=profile.name,
        profile=profile.model_dump(mode="json"),
        stops=stops,
        samples_per_stop=recipe.samples,
        versions=software_versions(),
        devices={"camera": {"kind": "drawn"}, "stage": {"firmware": "none <drawn>"}},
        note=recipe.note,
    )
    rng = np.random.default_rng(7)
    measured: dict[SampleKey, Measurement] = {}
    for stop in stops:
        for number in range(recipe.samples):
            share = stop.index / max(1, len(stops) - 1)
            multiview = replace(
                _pictures(profile, stop.distance_mm),
                temperature_degc=25.0 + recipe.rise_degc * share,
            )
            sample = store.add_sample(
                sweep_id,
                stop=stop.index,
                number=number,
                reached_mm=stop.distance_mm + 0.001 * stop.index,
                multiview=multiview,
            )
            measured[sample.key] = _measurement(recipe, stop, rng)
    store.save_measurements(sweep_id, measured)
    return store, conclude_sweep(store, sweep_id)


def bench_profile(overrides: tuple[str, ...] = ()) -> Profile:
    """Return the profile of the drawn rig, whose views are as small as `SCENE`."""
    small = (f"camera.width_px={SCENE.width}", f"camera.height_px={SCENE.height}", "name=bench")
    return load_profile("sim", (*small, *overrides))


def _pictures(profile: Profile, distance_mm: float) -> MultiView:
    places = [(view.x_steps, view.y_steps) for view in profile.views]
    return MultiView(
        tuple(
            Frame(view.name, _picture(distance_mm, place), timestamp_s=1.0, sequence=1)
            for view, place in zip(profile.views, places, strict=True)
        )
    )


@cache
def _picture(distance_mm: float, place: tuple[float, float]) -> NDArray[np.uint8]:
    clean = SCENE.with_changes(distance_mm=distance_mm).clean(*place)
    seed = [round(distance_mm), *(round(1000 + 100 * step) for step in place)]
    return digitised(clean, noise=1.0, rng=np.random.default_rng(seed))


def _measurement(recipe: SweepRecipe, stop: Stop, rng: np.random.Generator) -> Measurement:
    if stop.distance_mm in recipe.fails_at_mm:
        message = "asked for a board of 9 x 6 inner corners, found <none>; add light"
        return Measurement(failure=Failure("not-found", message))
    scene = SCENE.with_changes(distance_mm=stop.distance_mm)
    near_mm, far_mm = recipe.distances_mm[0], recipe.distances_mm[-1]
    place = (stop.distance_mm - near_mm) / (far_mm - near_mm)
    bend_px = recipe.bend_px * float(np.sin(3.0 * np.pi * place))
    a, b, c = scene.plane().tolist()
    slope_px = a + bend_px + recipe.noise_px * float(rng.standard_normal())
    low, right, bottom = -1.0, float(scene.columns), float(scene.rows)
    square = np.array([[low, low, 1], [right, low, 1], [right, bottom, 1], [low, bottom, 1]])
    outline = square @ scene.pixel_from_board().T
    return Measurement(
        slope_px=slope_px,
        sigma_px=recipe.noise_px,
        plane=(slope_px, b, c),
        centre_px=(float(scene.centre()[0]), float(scene.centre()[1])),
        corner_slope_px=slope_px + 0.004 * float(rng.standard_normal()),
        corner_sigma_px=0.004,
        dense_slope_px=slope_px + 0.006 + 0.002 * float(rng.standard_normal()),
        dense_sigma_px=0.004,
        dense_pixel_sigma_px=0.03,
        corners_px=tuple(map(_points, scene.corners() + 0.01 * rng.standard_normal((6, 9, 2)))),
        outline_px=_points(outline[:, :2] / outline[:, 2:]),
        track_residual_px=0.011,
    )


def _points(xy_px: NDArray[np.float64]) -> tuple[Point, ...]:
    return tuple((x, y) for x, y in xy_px.tolist())
