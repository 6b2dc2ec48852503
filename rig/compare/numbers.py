"""The numbers of a comparison for programs: what `--json` prints and compare.json keeps."""

import math
from collections.abc import Mapping
from dataclasses import asdict

from rig.compare.comparison import PAGE_FILE, Comparison, distance_scores


def comparison_as_dict(comparison: Comparison) -> dict[str, object]:
    """Return the numbers as the command line's JSON contract; what is unknown is None."""
    frames = comparison.frames
    return {
        "rig": comparison.profile.name,
        "curve": comparison.curve_id,
        "curve_title": comparison.curve_title,
        "sweep": comparison.sweep_id,
        "range_px": list(frames.range_px),
        "frames": {
            "count": frames.count,
            "size_px": list(frames.image.shape[::-1]),
            "partner": frames.partner,
            "baseline_steps": frames.baseline_steps,
            "disparities_px": list(frames.disparities_px),
            "methods": [_known(asdict(score)) for score in frames.scores],
        },
        "distances": [
            {
                "distance_mm": board.distance_mm,
                "window_px": list(board.window_px),
                "methods": [
                    {"method": name} | _known(asdict(error)) for name, error in board.errors.items()
                ],
            }
            for board in comparison.distances
        ],
        "curves": [_known(asdict(at)) for at in comparison.curves],
        "summary": [_known(asdict(score)) for score in distance_scores(comparison.distances)],
        "out": str(comparison.folder),
        "page": str(comparison.folder / PAGE_FILE),
    }


def _known(numbers: Mapping[str, object]) -> dict[str, object]:
    """Replace NaN, which JSON does not have."""
    return {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in numbers.items()
    }
