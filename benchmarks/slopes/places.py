"""Views that are not where they are told to be: errors borne, and errors found."""

from dataclasses import replace

import numpy as np

from benchmarks.slopes.scenes import DENSE, SPARSE, Array, Recipe, Scene, make_scene
from benchmarks.slopes.scores import score
from rig.epipolar import estimate_slopes
from rig.epipolar.placement import on_their_lines

_ERROR_PX = 0.1
"""1 sigma of the error of each picture in each direction, at the largest slope."""


def places() -> None:
    """Print what errors of 0.1 px do, of the part that a match can know."""
    print(
        f"{'scene':14} {'places':32} {'BP.01':>6} {'BP.03':>6} {'BP.07':>6} {'bad 1':>6} "
        f"{'edge':>6} {'sigma':>6}  misplaced, px"
    )
    for recipe in (Recipe("dense", 11, DENSE, noise=1.0), Recipe("sparse", 15, SPARSE)):
        scene = make_scene(recipe)
        _line(scene, "right", is_trusted=False)
        for kind, wrong in (("positions", _moved_cameras(scene)), ("pictures", _moved(scene))):
            _line(wrong, f"{kind} 0.1 px wrong, borne", is_trusted=True)
            _line(wrong, f"{kind} 0.1 px wrong, found", is_trusted=False)


def _line(scene: Scene, name: str, *, is_trusted: bool) -> None:
    found = estimate_slopes(scene.views, scene.range_px, trust_places=is_trusted)
    s = score(found.slope_px, found.sigma_px, scene.slope_px, scene.range_px, scene.border_px)
    told = "" if found.placement is None else np.round(found.placement.distance_px, 2).tolist()
    print(
        f"{scene.name:14} {name:32} {s.bad_001:6.2f} {s.bad_003:6.2f} {s.bad_007:6.2f} "
        f"{s.bad_1:6.2f} {s.edge_bad:6.2f} {s.sigma_ratio:6.2f}  {told}",
        flush=True,
    )


def _errors(scene: Scene) -> Array:
    """Random errors (V, 2) without the part in proportion to the positions."""
    places = np.stack([scene.views.x_steps, scene.views.y_steps], axis=1)
    errors = np.random.default_rng(5).standard_normal(places.shape)
    errors[scene.views.reference] = 0.0
    return errors - places * (errors * places).sum() / (places**2).sum()


def _moved_cameras(scene: Scene) -> Scene:
    error = _ERROR_PX / float(np.abs(scene.slope_px).max()) * _errors(scene)
    views = scene.views
    told = views.x_steps + error[:, 0], views.y_steps + error[:, 1]
    return replace(scene, views=replace(views, x_steps=told[0], y_steps=told[1]))


def _moved(scene: Scene) -> Scene:
    images = on_their_lines(scene.views.images.astype(np.float32), _ERROR_PX * _errors(scene))
    frames = np.clip(np.rint(images), 0, 255).astype(np.uint8)
    return replace(scene, views=replace(scene.views, images=frames))
