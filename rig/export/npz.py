"""numpy archives: every map of a frame by its name, with times and the camera."""

import io
import json
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from rig.export.frame_export import FrameExport
from rig.files import write_bytes
from rig.live.captured import CapturedFrame


class NpzExport(FrameExport):
    """Writes `frame_NNNNN.npz`, what is not known left out; read it with `numpy.load`."""

    __slots__ = ()
    format: ClassVar[str] = "npz"

    def write(self, frame: CapturedFrame, folder: Path) -> None:
        """See `FrameExport.write`."""
        content = io.BytesIO()
        np.savez(content, allow_pickle=False, **arrays_of(frame))
        write_bytes(folder / f"frame_{frame.index:05d}.npz", content.getvalue())


def arrays_of(frame: CapturedFrame) -> dict[str, Any]:
    """Return all that is known of a frame as arrays, by name.

    Raises:
        StoreError: a map is missing or damaged, or it is a recording.
    """
    arrays: dict[str, Any] = {
        "frame": np.int64(frame.index),
        "timestamp_s": np.float64(frame.timestamp_s),
        "slope_px": frame.slope_px,
        "label": frame.label,
        "facts": np.array(json.dumps(frame.facts)),
    }
    if frame.time_ns is not None:
        arrays["time_ns"] = np.int64(frame.time_ns)
    if frame.has_depth:
        arrays |= {"depth_mm": frame.depth_mm, "sigma_mm": frame.sigma_mm}
    else:
        arrays["sigma_px"] = frame.sigma_px
    pictures = {
        "image": frame.image,
        "colour": frame.colour,
        "virtual_depth": frame.virtual_depth,
    }
    arrays |= {name: pixels for name, pixels in pictures.items() if pixels is not None}
    if frame.pinhole is not None:
        arrays["camera_matrix"] = frame.pinhole.matrix
        arrays["common_from_reference"] = frame.pinhole.common_from_reference
    return arrays
