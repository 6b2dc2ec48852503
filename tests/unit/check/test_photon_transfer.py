"""Photon transfer against pictures with a noise that is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rig.check.photon_transfer import PhotonTransfer, photon_transfer

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


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(electrons=st.floats(5.0, 100.0), read=st.floats(0.3, 3.0), seed=st.integers(0, 99))
def test_gain_and_read_noise_are_those_of_the_pictures(electrons: float, read: float, seed: int):
    # Sixteen pictures leave the gain unsure by 5 % where read noise is most of it.
    found = photon_transfer(pictures(electrons, read, seed=seed, count=96), 255.0)
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


def alternating(
    levels: list[int], variances: list[float], pixels: int = 400
) -> NDArray[np.float64]:
    """Stripes of even levels, in which each pixel alternates about its level by an exact amount.

    Half of the pixels go up where the other half goes down: every picture is as bright as all.
    """
    stripes = []
    for level, variance in zip(levels, variances, strict=True):
        step = np.sqrt(variance / 2.0)  # successive pictures differ by two steps
        signs = np.where(np.arange(pixels) % 2 == 0, 1.0, -1.0)
        stripes.append(level + step * np.stack([signs, -signs, signs, -signs]))
    wide = [stripe.reshape(4, -1, 20) for stripe in stripes]
    return np.concatenate(wide, axis=1)


def test_a_pixel_has_the_noise_of_its_light_of_reading_and_of_rounding():
    line = PhotonTransfer(electrons_per_level=4.0, read_noise_levels=2.0, straightness=1.0)
    assert line.sigma_levels(100.0) == pytest.approx(np.sqrt(4.0 + 1 / 12 + 25.0))
    assert PhotonTransfer(-4.0, 2.0, 1.0).sigma_levels(100.0) == 0.0


def test_variances_on_a_line_give_that_line():
    levels = [32, 64, 96, 128, 160]
    found = photon_transfer(alternating(levels, [2.0 + level / 8.0 for level in levels]), 255.0)
    assert found is not None
    assert found.electrons_per_level == pytest.approx(8.0)
    assert found.read_noise_levels == pytest.approx(np.sqrt(2.0 - 1 / 12))
    assert found.straightness == pytest.approx(1.0)


def test_a_hill_of_variances_is_explained_by_no_line():
    found = photon_transfer(alternating([32, 64, 96], [2.0, 8.0, 2.0]), 255.0)
    assert found is not None
    assert abs(1.0 / found.electrons_per_level) < 1e-9
    # Of 20 rows to a stripe, those beside another stripe are not flat.
    floor = (19 * 2.0 + 18 * 8.0 + 19 * 2.0) / (19 + 18 + 19)
    assert found.read_noise_levels == pytest.approx(np.sqrt(floor - 1 / 12))
    assert found.straightness == pytest.approx(0.0, abs=1e-9)


def test_variances_that_are_all_alike_are_explained_by_nothing():
    found = photon_transfer(alternating([32, 64, 96], [2.0, 2.0, 2.0]), 255.0)
    assert found is not None
    assert found.straightness == pytest.approx(0.0, abs=0.5)
    assert found.read_noise_levels == pytest.approx(np.sqrt(2.0 - 1 / 12))


@pytest.mark.parametrize(
    ("levels", "is_told"),
    [
        ([32, 48, 64], True),
        ([32, 36, 96], True),  # the first two lie in neighbouring bins
        ([32, 48, 63], False),
        ([32, 128], False),
    ],
)
def test_a_line_needs_three_levels_and_twice_the_light(levels: list[int], is_told: bool):
    found = photon_transfer(alternating(levels, [0.5] * len(levels)), 255.0)
    assert (found is not None) == is_told


@pytest.mark.parametrize(("pixels", "is_told"), [(220, True), (200, False)])
def test_a_level_needs_two_hundred_pixels(pixels: int, is_told: bool):
    few = alternating([160], [0.5], pixels)  # 20 of them beside another stripe, which is not flat
    three = np.concatenate([alternating([32, 64], [0.5, 0.5]), few], axis=1)
    assert (photon_transfer(three, 255.0) is not None) == is_told


@pytest.mark.parametrize("end", [0, 255])
def test_pixels_that_touch_an_end_of_the_scale_do_not_count(end: int):
    images = alternating([32, 64, 96, 128], [2.0 + level / 8.0 for level in (32, 64, 96, 128)])
    touching = np.full((4, 20, 20), 250.0 if end else 5.0)
    touching[::2, :, ::2] = touching[1::2, :, 1::2] = end
    found = photon_transfer(np.concatenate([images, touching], axis=1), 255.0)
    assert found is not None
    assert found.electrons_per_level == pytest.approx(8.0, rel=1e-3)


def test_variances_count_by_how_sure_they_are():
    """Of n pixels a variance v is known to v times the root of 2 / n: three rounds of that."""
    levels, variances = np.array([32, 64, 96, 128]), np.array([2.0, 3.125, 8.0, 6.125])
    found = photon_transfer(alternating(levels.tolist(), variances.tolist()), 255.0)
    assert found is not None
    pixels = np.array([19.0, 18.0, 18.0, 19.0])  # rows that lie beside another stripe do not count
    model, rise, floor = variances, 0.0, 0.0
    for _ in range(3):
        rise, floor = np.polyfit(levels, variances, 1, w=np.sqrt(pixels) / model)
        model = floor + rise * levels
    assert found.electrons_per_level == pytest.approx(1.0 / rise)
    assert found.read_noise_levels == pytest.approx(np.sqrt(max(0.0, floor - 1 / 12)))
    spread = pixels @ (variances - np.average(variances, weights=pixels)) ** 2
    left = pixels @ (variances - model) ** 2
    assert found.straightness == pytest.approx(1.0 - left / spread)
