"""Slopes of epipolar lines: dense for every pixel, and one plane for a board."""

from rig.epipolar.views import Label, RectifiedViews, SlopeMap, SlopePrior

__all__ = ["Label", "RectifiedViews", "SlopeMap", "SlopePrior"]
