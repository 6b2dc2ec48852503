"""Whether scenes have told enough, or why not."""

import numpy as np

from rig.arrays import Flags, Float
from rig.epipolar.scene.found import MOST_FIELD_PX, FoundGeometry
from rig.epipolar.scene.rows import rows_sigma_px
from rig.geometry.bundle.result import Reason, Verdict

ENOUGH = 120
"""Features of a view from which their number is no reason."""
_CELLS, _IN_CELL, _MOST_EMPTY = 4, 2, 0.5
"""Of a picture's cells, each way; features from which one is covered; share that may be empty."""
_LEAST_SPAN = 0.01
"""Least spread of shifts along the lines, over the picture's width: turns and directions of
baselines look alike at one distance."""
FITTING = 0.6
"""Least share of features that fit: with fewer, what fits may be chance."""
MOST_ROWS_PX = 0.3
"""Rows that may be off by more (1 sigma, at the distances of the scene) are weak."""
_ENDS_PCT = (5.0, 95.0)
_NEARER = 1.5
"""Rows are judged as near as this times the nearest features."""


def judge_scene(found: FoundGeometry, source: str) -> Verdict:
    """Collect what speaks against a geometry from scenes.

    Args:
        found: the geometry.
        source: where its focal lengths come from, in words.
    """
    reasons: list[Reason] = []
    geometry = found.fit.geometry
    fits = found.fit.fits
    for view, name in enumerate(geometry.names):
        if view != geometry.reference:
            reasons += _of_view(found, view, name, fits & found.features.seen[:, view])
    share = float(fits.mean())
    if share < FITTING:
        reasons.append(
            Reason(
                "matches",
                f"only {100 * share:.0f} % of the features fit ({100 * FITTING:.0f} % wanted): "
                "did something move between the views, or does the scene repeat itself?",
            )
        )
    sigma_px = rows_sigma_of(found)
    if not sigma_px <= MOST_ROWS_PX:
        reasons.append(
            Reason(
                "rows",
                f"rows are only known to {sigma_px:.2f} px (1 sigma over the picture; "
                f"{MOST_ROWS_PX} wanted); show more scenes, near and far, all over the picture",
            )
        )
    return Verdict(tuple(reasons), _notes(found, source), ())


def rows_sigma_of(found: FoundGeometry) -> float:
    """How far rows may be off at the distances of the scenes, px rms, 1 sigma."""
    low, high = _inverse_ends(found)
    return rows_sigma_px(found.fit.geometry, np.linspace(max(low, 0.0), _NEARER * high, 3))


def spans_px(found: FoundGeometry, view: int, shown: Flags) -> float:
    """Spread of shifts along the lines of a view, px: from what is far to what is near."""
    slope = np.linalg.norm(found.fit.at.by_inverse[shown, view], axis=1)
    shift_px = found.fit.at.inverse_per_mm[shown] * slope * found.features.sigma_px[shown, view]
    if not shift_px.size:
        return 0.0
    low_px, high_px = np.percentile(shift_px, _ENDS_PCT).tolist()
    return high_px - low_px


def empty_share(reference_px: Float, size_px: tuple[int, int]) -> float:
    """Share of the cells of a picture without features."""
    cell = np.clip((reference_px * _CELLS / np.array(size_px)).astype(int), 0, _CELLS - 1)
    counts = np.bincount(cell[:, 1] * _CELLS + cell[:, 0], minlength=_CELLS**2)
    return float(np.mean(counts < _IN_CELL))


def _of_view(found: FoundGeometry, view: int, name: str, shown: Flags) -> list[Reason]:
    reasons: list[Reason] = []
    camera = found.fit.geometry.cameras[found.fit.geometry.reference]
    count = int(shown.sum())
    if count < ENOUGH:
        reasons.append(
            Reason(
                "few-features",
                f"{name}: {count} features fit, {ENOUGH} wanted; show scenes with more texture",
            )
        )
    empty = empty_share(found.features.reference_px[shown], (camera.width_px, camera.height_px))
    if empty > _MOST_EMPTY:
        reasons.append(
            Reason(
                "one-part",
                f"{name}: {100 * empty:.0f} % of the picture have no features "
                f"({100 * _MOST_EMPTY:.0f} % allowed); show texture in all of it",
            )
        )
    span_px, least_px = spans_px(found, view, shown), _LEAST_SPAN * camera.width_px
    if span_px < least_px:
        reasons.append(
            Reason(
                "one-distance",
                f"{name}: all features are at about one distance (shifts span {span_px:.1f} px, "
                f"{least_px:.1f} wanted); show near and far things in one picture",
            )
        )
    field = found.fields[view]
    if field is not None and field.is_sure and field.rms_px > MOST_FIELD_PX:
        reasons.append(
            Reason(
                "model",
                f"{name}: rows still miss by a smooth {field.rms_px:.2f} px rms "
                f"({MOST_FIELD_PX} allowed): this lens is another one; calibrate with a board",
            )
        )
    return reasons


def _notes(found: FoundGeometry, source: str) -> tuple[str, ...]:
    notes = [
        "lengths by the profile's pitch_mm, not measured: depth is as true as that and as the "
        f"focal length ({source})"
    ]
    if found.before is not None:
        worst = max((one.rms_px for one in found.before if one is not None), default=0.0)
        notes.append(
            f"rotations and focal lengths left a smooth {worst:.2f} px rms across the lines: lens "
            "terms were found as well"
        )
    return tuple(notes)


def _inverse_ends(found: FoundGeometry) -> tuple[float, float]:
    inverse = found.fit.at.inverse_per_mm[found.fit.fits]
    low, high = np.percentile(inverse, _ENDS_PCT).tolist()
    return low, high
