"""Photon transfer against pictures with a noise that is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rig.check.photon_transfer import photon_transfer

WIDTH, HEIGHT = 160, 120


def pictures(
    electrons_per_level: float,
    read_noise_levels: float,
    *,
    count: int = 16,
    seed: int = 1,
    flicker: float = 0.0,
    bits: int = 8,
) -> NDArray[np.uint8 | np.uint16]:
    """Draw a scene of 16 x 12 even patches with photon noise and read noise."""
    random = np.random.default_rng(seed)
    scale = (2**bits - 1) / 255.0
    patches = random.uniform(8.0, 200.0, (HEIGHT // 10, WIDTH // 10))
    mean = np.kron(patches, np.ones((10, 10)))
    lamp = 1.0 + flicker * random.uniform(-1.0, 1.0, (count, 1, 1))
    electrons = random.poisson(mean * lamp * electrons_per_level)
    levels = electrons / electrons_per_level + random.normal(
        0.0, read_noise_levels, electrons.shape
    )
    kind = np.uint8 if bits == 8 else np.uint16
    return np.clip(np.rint(levels * scale), 0, 2**bits - 1).astype(kind)


@settings(max_examples=15, deadline=None)
@given(electrons=st.floats(5.0, 100.0), read=st.floats(0.3, 3.0), seed=st.integers(0, 99))
def test_gain_and_read_noise_are_those_of_the_pictures(electrons: float, read: float, seed: int):
    found = photon_transfer(pictures(electrons, read, seed=seed), 255.0)
    assert found is not None
    assert found.electrons_per_level == pytest.approx(electrons, rel=0.1)
    assert found.sigma_levels(100.0) == pytest.approx(
        np.sqrt(read**2 + 1 / 12 + 100.0 / electrons), rel=0.03
    )


def test_read_noise_is_found_without_the_rounding():
    found = photon_transfer(pictures(40.0, 1.0, count=40), 255.0)
    assert found is not None
    assert found.read_noise_levels == pytest.approx(1.0, rel=0.05)
    assert found.straightness > 0.95


def test_sixteen_bits_are_measured_in_their_own_levels():
    found = photon_transfer(pictures(40.0, 1.0, bits=16), 65535.0)
    assert found is not None
    assert found.electrons_per_level == pytest.approx(40.0 / 257.0, rel=0.05)


def test_a_lamp_that_flickers_is_no_noise():
    steady = photon_transfer(pictures(40.0, 1.0), 255.0)
    flickering = photon_transfer(pictures(40.0, 1.0, flicker=0.05), 255.0)
    assert steady is not None
    assert flickering is not None
    assert flickering.sigma_levels(150.0) == pytest.approx(steady.sigma_levels(150.0), rel=0.03)


def test_noise_that_does_not_follow_light_is_not_straight():
    random = np.random.default_rng(3)
    mean = np.kron(random.uniform(20.0, 200.0, (12, 16)), np.ones((10, 10)))
    even = np.rint(mean + random.normal(0.0, 2.0, (16, *mean.shape))).astype(np.uint8)
    found = photon_transfer(even, 255.0)
    assert found is not None
    assert found.straightness < 0.3


def test_an_even_scene_tells_nothing():
    even = np.random.default_rng(1).integers(98, 103, (8, 60, 80)).astype(np.uint8)
    assert photon_transfer(even, 255.0) is None


def test_a_black_or_burnt_scene_tells_nothing():
    for level in (0, 255):
        assert photon_transfer(np.full((8, 60, 80), level, np.uint8), 255.0) is None
