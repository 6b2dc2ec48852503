"""Views that are not where they are told to be: errors borne, and errors found."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.antinous import load_antinous
from benchmarks.slopes.scenes import DENSE, SPARSE, Array, Recipe, Scene, make_scene
from benchmarks.slopes.scores import score
from rig.epipolar import SlopeMap, estimate_slopes
from rig.epipolar.placement.placement import on_their_lines

_ERROR_PX, _ERROR_STEPS = 0.1, 0.1
"""1 sigma of the error of each picture in each direction, at the largest slope; and of positions
that are told badly."""
_DRAWS = 4
"""One draw of errors has one common factor, which no match can know: sigma holds over many."""
Errors = Callable[[Scene, Array], Scene]


def places() -> None:
    """Print what errors of 0.1 px and 0.1 steps do; sigma over all draws together."""
    print(
        f"{'scene':22} {'places':34} {'BP.01':>6} {'BP.03':>6} {'BP.07':>6} {'bad 1':>6} "
        f"{'edge':>6} {'sigma':>6}  misplaced views, on average"
    )
    dense = make_scene(Recipe("dense", 11, DENSE, noise=1.0))
    sparse = make_scene(Recipe("sparse", 15, SPARSE))
    for scene in (dense, sparse):
        _line(scene.name, "right", [scene], is_trusted=True)
        _line(scene.name, "right, not trusted", [scene], is_trusted=False)
        for kind, errors in (("positions", _cameras), ("pictures", _pictures)):
            draws = _draws(scene, errors)
            _line(scene.name, f"{kind} 0.1 px wrong, borne", draws, is_trusted=True)
            _line(scene.name, f"{kind} 0.1 px wrong, found", draws, is_trusted=False)
    antinous = load_antinous("cross")
    if antinous is not None:
        _line(antinous.name, "right", [antinous], is_trusted=True)
        _line(antinous.name, "right, not trusted", [antinous], is_trusted=False)
    for scene in (dense, antinous):
        if scene is not None:
            draws = _draws(scene, _badly_told)
            _line(scene.name, "positions 0.1 steps wrong, found", draws, is_trusted=False)


def _line(name: str, told: str, scenes: Sequence[Scene], *, is_trusted: bool) -> None:
    found = [estimate_slopes(s.views, s.range_px, trust_places=is_trusted) for s in scenes]
    scores = [
        score(f.slope_px, f.sigma_px, s.slope_px, s.range_px, s.border_px)
        for f, s in zip(found, scenes, strict=True)
    ]
    bad = [(s.bad_001, s.bad_003, s.bad_007, s.bad_1, s.edge_bad) for s in scores]
    of_sigma = np.concatenate([_errors_of_sigma(f, s) for f, s in zip(found, scenes, strict=True)])
    misplaced = [0 if f.placement is None else int(f.placement.misplaced.sum()) for f in found]
    print(
        f"{name:22} {told:34} {' '.join(f'{b:6.2f}' for b in np.mean(bad, axis=0))} "
        f"{1.4826 * float(np.nanmedian(of_sigma)):6.2f}  {np.mean(misplaced):.1f}",
        flush=True,
    )


def _errors_of_sigma(found: SlopeMap, scene: Scene) -> NDArray[np.floating]:
    inner = (slice(scene.border_px, -scene.border_px or None),) * 2
    return np.abs((found.slope_px - scene.slope_px) / found.sigma_px)[inner].ravel()


def _draws(scene: Scene, errors: Errors) -> list[Scene]:
    drawn: list[Scene] = []
    for seed in range(5, 5 + _DRAWS):
        error = np.random.default_rng(seed).standard_normal((len(scene.views.images), 2))
        error[scene.views.reference] = 0.0
        drawn.append(errors(scene, error))
    return drawn


def _cameras(scene: Scene, error: Array) -> Scene:
    return _told(scene, _ERROR_PX / float(np.abs(scene.slope_px).max()) * error)


def _badly_told(scene: Scene, error: Array) -> Scene:
    return _told(scene, _ERROR_STEPS * error)


def _told(scene: Scene, error_steps: Array) -> Scene:
    views = scene.views
    told = views.x_steps + error_steps[:, 0], views.y_steps + error_steps[:, 1]
    return replace(scene, views=replace(views, x_steps=told[0], y_steps=told[1]))


def _pictures(scene: Scene, error: Array) -> Scene:
    images = on_their_lines(scene.views.images.astype(np.float32), _ERROR_PX * error)
    frames = np.clip(np.rint(images), 0, 255).astype(np.uint8)
    return replace(scene, views=replace(scene.views, images=frames))
