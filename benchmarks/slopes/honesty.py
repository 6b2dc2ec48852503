"""Whether the estimator knows what it knows: blind, answered, wrong, and how sure it was of it."""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.antinous import load_antinous
from benchmarks.slopes.asked import Asked
from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.scenes import (
    CHOSEN_ON,
    LAYOUTS,
    REPORTED_ON,
    WIDE_RANGE_PX,
    Recipe,
    Scene,
    make_scene,
)
from benchmarks.slopes.texture import textured
from rig.epipolar import Label, SlopeMap, estimate_slopes

_BLIND_SHARE = 0.25
"""Who knows less than a quarter of a blind guess has not answered."""
_SURE_SIGMAS, _FAR_SIGMAS = 5.0, 3.0
_FIFTHS, _SUREST_SHARE = 5, 0.8
_TOLD_CHARACTERS = 110
"""So much of a warning is shown."""


@dataclass(frozen=True)
class Honesty:
    """Shares in per cent. Blind pixels count as bad where all pixels are asked for."""

    blind: float
    answered: float
    bad: float
    bad_answered: float
    """Bad at 0.07 px in dense scenes, at 1 px in others: of all pixels and of the answered ones."""
    bad_surest: float
    """The same of the surest 80 % of all pixels: equal density whatever is blind."""
    wrong: float
    wrong_textured: float
    """Confidently wrong: by more than 0.07 px (dense) or 0.5 px, and more than 5 sigma; of all
    pixels and of those with texture."""
    sigma_ratio: float
    """Robust standard deviation of error / sigma over answered pixels."""
    fifths: tuple[float, ...]
    """The same in each fifth of the answers, from the most to the least confident."""
    beyond_3: float
    """Share of the answers that miss by more than 3 sigma."""
    density: float
    """Share of the pixels with texture that are answered; NaN where texture was not asked for."""


def measure_honesty(
    found: SlopeMap,
    true_px: NDArray[np.floating],
    range_px: tuple[float, float],
    border_px: int = 0,
    has_texture: NDArray[np.bool_] | None = None,
) -> Honesty:
    """Compare with true slopes (H, W), NaN where they are unknown."""
    inner = (slice(border_px, -border_px or None),) * 2
    known = np.isfinite(true_px[inner])
    error = np.abs(found.slope_px - true_px)[inner][known].astype(np.float64)
    sigma = found.sigma_px[inner][known].astype(np.float64)
    sighted = found.label[inner][known] != Label.NONE
    width_px = range_px[1] - range_px[0]
    with np.errstate(invalid="ignore"):
        answered = sighted & (sigma <= _BLIND_SHARE * width_px / np.sqrt(12.0))
    bad_px, wrong_px = (0.07, 0.07) if width_px <= WIDE_RANGE_PX else (1.0, 0.5)
    error[~sighted] = np.inf
    wrong = sighted & (error > wrong_px) & (error > _SURE_SIGMAS * np.nan_to_num(sigma))
    ranked = np.argsort(np.where(sighted, sigma, np.inf), kind="stable")
    surest = ranked[: int(_SUREST_SHARE * error.size)]
    z = error[answered] / np.maximum(sigma[answered], 1e-9)
    order = np.argsort(sigma[answered], kind="stable")
    wrong_textured = density = np.nan
    if has_texture is not None:
        chosen = has_texture[inner][known]
        wrong_textured, density = _per_cent(wrong[chosen]), _per_cent(answered[chosen])
    return Honesty(
        blind=_per_cent(~sighted),
        answered=_per_cent(answered),
        bad=_per_cent(~(error <= bad_px)),
        bad_answered=_per_cent(error[answered] > bad_px),
        bad_surest=_per_cent(~(error[surest] <= bad_px)),
        wrong=_per_cent(wrong),
        wrong_textured=wrong_textured,
        sigma_ratio=_robust_std(z),
        fifths=tuple(_robust_std(z[part]) for part in np.array_split(order, _FIFTHS)),
        beyond_3=_per_cent(z > _FAR_SIGMAS),
        density=density,
    )


def _per_cent(where: NDArray[np.bool_]) -> float:
    return 100.0 * float(where.mean()) if where.size else float("nan")


def _robust_std(z: NDArray[np.float64]) -> float:
    return 1.4826 * float(np.median(z)) if z.size else float("nan")


HONESTY_HEAD = (
    f"{'blind':>6} {'answd':>6} {'bad':>6} {'bad/a':>6} {'bad/80':>6} {'cw':>6} {'cw/t':>6} "
    f"{'z':>5}   {'z of fifths, surest first':29} {'>3s':>5} {'dens':>5}"
)
LEGEND = """\
Per cent. answd: sigma within a quarter of a blind guess; bad: by 0.07 px dense, 1 px else, of all
(blind is bad), /a of the answered, /80 of the surest 80 % of all; cw: confidently wrong, by 0.07 px
or 0.5 px and 5 sigma, of all, /t of those with texture; z: robust std of error / sigma; >3s: of the
answered; dens: textured ones answered. C: defaults were chosen on it, R: it is only reported."""


def honesty_columns(h: Honesty) -> str:
    """The figures under `HONESTY_HEAD`."""
    fifths = " ".join(f"{ratio:5.2f}" for ratio in h.fifths)
    return (
        f"{h.blind:6.1f} {h.answered:6.1f} {h.bad:6.2f} {h.bad_answered:6.2f} {h.bad_surest:6.2f} "
        f"{h.wrong:6.2f} {h.wrong_textured:6.2f} {h.sigma_ratio:5.2f}   {fifths} {h.beyond_3:5.1f} "
        f"{h.density:5.1f}"
    )


def told(warnings: Iterable[str]) -> str:
    """Warnings, shortened to what fits a line."""
    text = " | ".join(warnings)
    return text if len(text) <= _TOLD_CHARACTERS else text[: _TOLD_CHARACTERS - 3] + "..."


def print_honesty(scenes: Iterable[Scene]) -> None:
    """One line for every scene."""
    print(LEGEND)
    print(f"{'':1} {'scene':30} {HONESTY_HEAD} {'s':>5}  warnings")
    for scene in scenes:
        start = time.perf_counter()
        found = estimate_slopes(scene.views, scene.range_px)
        took_s = time.perf_counter() - start
        h = measure_honesty(found, scene.slope_px, scene.range_px, scene.border_px, textured(scene))
        print(
            f"{scene.half:1} {scene.name:30} {honesty_columns(h)} {took_s:5.2f}  "
            f"{told(found.warnings)}",
            flush=True,
        )


def honest(asked: Asked) -> None:
    """All scenes of `scenes.py`, and the light fields where they are present."""
    print_honesty(_scenes(asked))


def _scenes(asked: Asked) -> Iterator[Scene]:
    folder = dino_folder()
    for noise in (0.0, 3.0):
        if folder is not None and asked.wants(f"hci-dino, noise {noise:g}"):
            yield load_dino(folder, noise)
    for arms in ("cross", "row", "column"):
        if asked.wants(f"hci-antinous, {arms}"):
            scene = load_antinous(arms)
            if scene is not None:
                yield scene
    yield from (make_scene(r) for r in _recipes() if asked.wants(r.name))


def _recipes() -> Iterator[Recipe]:
    yield from CHOSEN_ON
    yield from REPORTED_ON
    yield from LAYOUTS
