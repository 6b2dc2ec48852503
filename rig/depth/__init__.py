"""Depth maps: made of slopes by a curve, kept in files."""

from rig.depth.depth_map import DepthMap, depth_from_slopes
from rig.depth.pfm import read_pfm, write_pfm
from rig.depth.png import write_depth_png, write_label_png, write_picture_png
from rig.files import write_bytes

__all__ = [
    "DepthMap",
    "depth_from_slopes",
    "read_pfm",
    "write_bytes",
    "write_depth_png",
    "write_label_png",
    "write_pfm",
    "write_picture_png",
]
