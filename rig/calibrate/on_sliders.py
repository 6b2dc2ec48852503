"""The calibration of one camera that stages carry: one lens, on straight lines."""

from dataclasses import replace

import numpy as np

from rig.calibrate.collection import Collection
from rig.calibrate.solve import SolveChoices
from rig.geometry.bundle import Calibration
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
            verdict=free.verdict,
        ),
        sliders,
    )
