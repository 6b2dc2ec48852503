"""Noise that grows with light: one noise for all pixels, that of the pictures, and the true one."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import SHADED, Scene, make_scene
from rig.epipolar import NoiseModel, SlopeMap, estimate_slopes

_DARK = 60.0
"""Grey value below which a pixel lies in the shadow."""


def shade() -> None:
    """Print error and sigma in the dark and in the bright half of each scene."""
    print(
        f"{'scene':24} {'noise':16} {'dark: bad':>10} {'median px':>10} {'sigma':>6} "
        f"{'bright: bad':>12} {'median px':>10} {'sigma':>6}"
    )
    for recipe in SHADED:
        scene = make_scene(recipe)
        dark = scene.views.images[0] < _DARK
        true = NoiseModel(recipe.noise, recipe.electrons_per_level or np.inf)
        for name, model in (
            ("one for all", NoiseModel(true.sigma_levels(20.0))),
            ("of the pictures", None),
            ("as measured", true),
        ):
            found = estimate_slopes(scene.views, scene.range_px, noise=model)
            parts = " ".join(_half(scene, found, part) for part in (dark, ~dark))
            print(f"{scene.name:24} {name:16} {parts}", flush=True)


def _half(scene: Scene, found: SlopeMap, part: NDArray[np.bool_]) -> str:
    """Per cent bad, median error and sigma of some pixels."""
    limit_px = 1.0 if scene.range_px[1] - scene.range_px[0] > 10 else 0.07
    error = np.abs(found.slope_px - scene.slope_px)[part]
    error[~np.isfinite(error)] = np.inf
    bad = 100.0 * float((error > limit_px).mean())
    sigma = 1.4826 * float(np.nanmedian(error / found.sigma_px[part]))
    return f"{bad:11.2f} {np.median(error):10.4f} {sigma:6.2f}"
