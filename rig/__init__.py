"""rig: the bench tool that turns a multi-view camera into a calibrated depth camera.

    with rig.open("my-rig") as camera:
        for frame in camera:
            frame.depth_mm, frame.sigma_mm, frame.label

What `__all__` names is the public API, see docs/api/python-api.md. Nothing is loaded before it is
used.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig import errors
    from rig.curve import Curve
    from rig.epipolar import RectifiedViews, SlopeMap, estimate_slopes
    from rig.frames import Frame, MultiView
    from rig.geometry.pinhole import Pinhole
    from rig.live.camera import DepthCamera
    from rig.live.captured import CapturedFrame, read_capture
    from rig.live.curves import load_curve
    from rig.live.frame import DepthFrame
    from rig.live.opening import open_depth_camera as open  # noqa: A004 - reads as rig.open

__version__ = "0.1.0"

__all__ = [
    "CapturedFrame",
    "Curve",
    "DepthCamera",
    "DepthFrame",
    "Frame",
    "MultiView",
    "Pinhole",
    "RectifiedViews",
    "SlopeMap",
    "__version__",
    "errors",
    "estimate_slopes",
    "load_curve",
    "open",
    "read_capture",
]

_HOMES = {
    "CapturedFrame": "rig.live.captured:CapturedFrame",
    "Curve": "rig.curve:Curve",
    "DepthCamera": "rig.live.camera:DepthCamera",
    "DepthFrame": "rig.live.frame:DepthFrame",
    "Frame": "rig.frames:Frame",
    "MultiView": "rig.frames:MultiView",
    "Pinhole": "rig.geometry.pinhole:Pinhole",
    "RectifiedViews": "rig.epipolar:RectifiedViews",
    "SlopeMap": "rig.epipolar:SlopeMap",
    "errors": "rig.errors:",
    "estimate_slopes": "rig.epipolar:estimate_slopes",
    "load_curve": "rig.live.curves:load_curve",
    "open": "rig.live.opening:open_depth_camera",
    "read_capture": "rig.live.captured:read_capture",
}
"""Where each name of the API is; tests hold it equal to `__all__`."""


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module_name, _, attribute = home.partition(":")
    module = importlib.import_module(module_name)
    found: object = getattr(module, attribute) if attribute else module
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
