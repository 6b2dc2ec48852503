"""Slopes of epipolar lines: dense for every pixel, and one plane for a board."""

from rig.epipolar.estimate import estimate_slopes
from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.placement.placement import Placement
from rig.epipolar.views import Label, RectifiedViews, SlopeMap, SlopePrior

__all__ = [
    "Label",
    "NoiseModel",
    "Placement",
    "RectifiedViews",
    "SlopeMap",
    "SlopePrior",
    "estimate_slopes",
]
