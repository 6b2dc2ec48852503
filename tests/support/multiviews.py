"""Small noisy multi-views, different for every seed."""

from dataclasses import fields, replace
from typing import cast

import numpy as np

from rig.frames import Frame, GreyImage, MultiView

VIEWS = ("centre", "left", "top")
_BESIDE_IMAGE = tuple(
    field.name for field in fields(Frame) if field.name not in ("image", "colour")
)


def noisy_multiview(
    seed: int, *, dtype: type[np.uint8 | np.uint16] = np.uint8, size_px: tuple[int, int] = (24, 16)
) -> MultiView:
    """Return three views of pure noise over the whole range of `dtype`."""
    random = np.random.default_rng(seed)
    width_px, height_px = size_px
    levels = np.iinfo(dtype).max + 1

    def frame(place: int, view: str) -> Frame:
        image = cast("GreyImage", random.integers(0, levels, (height_px, width_px), dtype=dtype))
        timestamp_s = float(1e5 + seed + random.uniform(0.0, 1e-3))
        return Frame(view, image, timestamp_s, 2**40 + seed, None if place == 2 else 0.1 / 3.0)

    frames = tuple(frame(place, view) for place, view in enumerate(VIEWS))
    return MultiView(frames, temperature_degc=None if seed % 2 else 100.0 / 3.0)


def ten_bit_multiview() -> MultiView:
    """Return 16-bit views of 10 bits whose exposures may have been up to 0.03 s earlier."""
    multiview = noisy_multiview(3, dtype=np.uint16)
    frames = tuple(
        replace(frame, image=frame.image >> np.uint16(6), bits=10, uncertainty_s=0.03)
        for frame in multiview.frames
    )
    return replace(multiview, frames=frames)


def same_multiview(one: MultiView, other: MultiView) -> bool:
    """Tell whether every pixel, time and number is the same."""

    def rest(multiview: MultiView) -> object:
        return multiview.temperature_degc, [
            (f.image.dtype, {name: getattr(f, name) for name in _BESIDE_IMAGE})
            for f in multiview.frames
        ]

    return rest(one) == rest(other) and all(
        np.array_equal(a.image, b.image) for a, b in zip(one.frames, other.frames, strict=True)
    )
