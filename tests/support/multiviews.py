"""Small noisy multi-views, different for every seed."""

from typing import cast

import numpy as np

from rig.frames import Frame, GreyImage, MultiView

VIEWS = ("centre", "left", "top")


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


def same_multiview(one: MultiView, other: MultiView) -> bool:
    """Tell whether every pixel, time and number is the same."""

    def rest(multiview: MultiView) -> object:
        return multiview.temperature_degc, [
            (f.view, f.timestamp_s, f.sequence, f.exposure_s, f.image.dtype)
            for f in multiview.frames
        ]

    return rest(one) == rest(other) and all(
        np.array_equal(a.image, b.image) for a, b in zip(one.frames, other.frames, strict=True)
    )
