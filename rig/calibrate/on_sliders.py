"""The calibration of one camera that stages carry: one lens, on straight lines."""

from dataclasses import replace

import numpy as np

from rig.calibrate.collection import Collection
from rig.calibrate.solve import SolveChoices
from rig.geometry.bundle import Calibration
from rig.geometry.bundle.coverage import missing_corners, no_board_in
from rig.geometry.bundle.result import Reason
from rig.geometry.slider import Sliders, tied_to_sliders


def on_sliders(collection: Collection, free: Calibration) -> tuple[Calibration, Sliders]:
    """Return the calibration whose views are one lens at the places that were read back.

    Boards, warp and residuals are solved anew with it.

    Args:
        collection: every picture of it is a scan.
        free: the same pictures, each view on its own; its verdict judges the pictures.

    Raises:
        CalibrationError: the places do not determine the sliders.
    """
    read = np.array([one.places_mm for one in collection.sightings if one.places_mm is not None])
    geometry, sliders = tied_to_sliders(free.geometry, read.mean(axis=0))
    tied = collection.solved(SolveChoices(lens=free.lens, start=geometry, fixed="all"))
    return (
        replace(
            tied,
            lens_scores=free.lens_scores,
            error_scale=free.error_scale,
            verdict=replace(free.verdict, reasons=_reasons(collection, free, tied)),
        ),
        sliders,
    )


def _reasons(collection: Collection, free: Calibration, tied: Calibration) -> tuple[Reason, ...]:
    """What speaks against the calibration.

    Of the pictures what the free solve says, but for the corners: what one view does not show the
    lens has shown in another one. Of the depth what the tied geometry says.
    """
    kept = [r for r in free.verdict.reasons if r.code not in ("corners", "depth-error")]
    kept += [r for r in tied.verdict.reasons if r.code == "depth-error"]
    size_px = collection.sightings[0].sizes_px[0]
    found = [s.xy_px / size_px for one in collection.sightings for s in one.sightings]
    missing = missing_corners(np.concatenate(found))
    if missing:
        kept.append(no_board_in(f"any view ({', '.join(missing)})"))
    return tuple(kept)
