"""Measuring beside the motion: in order, and with the pictures of few samples in memory."""

import threading
import weakref
from collections.abc import Iterator

import numpy as np
import pytest

from rig.errors import StoreError
from rig.frames import GreyImage, Pictures
from rig.measurement import Measurement
from rig.sweep.measuring_thread import MOST_HELD, MeasuringThread

SHAPE = (2, 4, 4)


class Gate:
    """Measures the grey value of a sample once it is let through."""

    def __init__(self) -> None:
        self._open = threading.Event()

    def open(self) -> None:
        self._open.set()

    def __call__(self, images: Pictures) -> Measurement:
        assert self._open.wait(60.0)
        return Measurement(slope_px=float(images[0][0, 0]))


@pytest.fixture
def gate() -> Iterator[Gate]:
    made = Gate()
    yield made
    made.open()


def pictures(level: int) -> GreyImage:
    return np.full(SHAPE, level, np.uint8)


def test_only_the_pictures_of_a_few_samples_wait_in_memory(gate: Gate):
    held: list[weakref.ref[GreyImage]] = []
    read: list[int] = []

    def again(number: int) -> GreyImage:
        read.append(number)
        return pictures(100 + number)

    with MeasuringThread(gate) as measuring:
        for number in range(MOST_HELD + 5):
            images = pictures(number)
            held.append(weakref.ref(images))
            measuring.submit((0, number), images, lambda number=number: again(number))
            del images
        alive = [number for number, picture in enumerate(held) if picture() is not None]
        assert alive == list(range(MOST_HELD))
        assert measuring.finished() == {}
        gate.open()
        measured = {key[1]: found.slope_px for key, found in measuring.remaining()}
    assert list(measured) == list(range(MOST_HELD + 5))
    # Those that were let go of were read back, and each was measured once.
    assert read == list(range(MOST_HELD, MOST_HELD + 5))
    assert measured == {n: float(n if n < MOST_HELD else 100 + n) for n in measured}


def test_pictures_that_cannot_be_read_back_end_the_sweep(gate: Gate):
    def gone() -> GreyImage:
        raise StoreError("left.png: it is missing")

    with MeasuringThread(gate) as measuring:
        for number in range(MOST_HELD + 1):
            measuring.submit((0, number), pictures(number), gone)
        gate.open()
        found = measuring.remaining()
        assert [next(found)[1].slope_px for _ in range(MOST_HELD)] == [0.0, 1.0, 2.0, 3.0]
        with pytest.raises(StoreError, match="it is missing"):
            next(found)
