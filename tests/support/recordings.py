"""Small multi-views with something in every field, and recordings of them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.frames import Frame, GreyImage, MultiView
from rig.recording import RecordingWriter

FIRST_NS = 1_764_500_000_123_456_789
"""Time of the first multi-view, UTC."""
VIEWS = ("left", "right")


def time_ns(number: int) -> int:
    """Time of a multi-view: 20 a second."""
    return FIRST_NS + 50_000_000 * number


def pixels(counts: NDArray[np.int64], bits: int) -> GreyImage:
    return counts.astype(np.uint8) if bits == 8 else counts.astype(np.uint16)


def taken(number: int, *, bits: int = 10) -> MultiView:
    """Return a multi-view with something in every field."""
    random = np.random.default_rng(number)
    counts = random.integers(0, 1 << bits, (6, 9))
    frames = tuple(
        Frame(
            view=view,
            image=pixels(counts + shift, bits),
            timestamp_s=100.0 + number / 7.0 + 0.001 * shift,
            sequence=3 * number + shift,
            exposure_s=0.008 if shift else None,
            bits=None if bits == 8 else bits,
            uncertainty_s=0.002 * shift,
        )
        for shift, view in enumerate(VIEWS)
    )
    return MultiView(frames, temperature_degc=31.5 if number else None)


def written(path: Path, count: int = 5, *, bits: int = 10) -> list[MultiView]:
    """Record some multi-views; return them."""
    content = [taken(number, bits=bits) for number in range(count)]
    with RecordingWriter(path, VIEWS, {"kind": "any", "serial": "7"}) as recording:
        for number, multiview in enumerate(content):
            recording.write(multiview, time_ns(number))
    return content


def assert_same(found: MultiView, expected: MultiView) -> None:
    """Two multi-views are equal in every field."""
    assert found.temperature_degc == expected.temperature_degc
    for one, other in zip(found.frames, expected.frames, strict=True):
        assert np.array_equal(one.image, other.image)
        assert one.image.dtype == other.image.dtype
        for name in ("view", "timestamp_s", "sequence", "exposure_s", "bits", "uncertainty_s"):
            assert getattr(one, name) == getattr(other, name)
