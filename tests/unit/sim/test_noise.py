import numpy as np
import pytest
from rig_sim.noise import Exposure

from rig.profile.world import SensorConfig, ViewErrorConfig

SHAPE = (120, 160)


def exposure(light: float, sensor: SensorConfig, error: ViewErrorConfig | None = None) -> Exposure:
    flat = np.full(SHAPE, light, np.float32)
    return Exposure.of(flat, sensor, error or ViewErrorConfig(), blur_px=0.8)


@pytest.mark.parametrize("light", [0.0, 0.2, 0.7])
def test_noise_follows_the_photon_transfer_curve(light: float):
    sensor = SensorConfig(electrons_per_level=10.0, read_noise_levels=1.5, black_level=20.0)
    image = exposure(light, sensor).draw((1,)).astype(float)
    signal = light * 235.0
    variance = signal / 10.0 + 1.5**2 + 1.0 / 12.0  # the last term is the quantisation's
    assert image.mean() == pytest.approx(20.0 + signal, abs=0.15)
    assert image.var() == pytest.approx(variance, rel=0.06)


def test_the_same_seed_draws_the_same_image_and_another_one_does_not():
    exposed = exposure(0.5, SensorConfig())
    np.testing.assert_array_equal(exposed.draw((1, 2, 3)), exposed.draw((1, 2, 3)))
    assert (exposed.draw((1, 2, 3)) != exposed.draw((1, 2, 4))).mean() > 0.5


def test_gain_and_offset_of_a_camera_show_in_its_levels():
    sensor = SensorConfig(black_level=4.0)
    error = ViewErrorConfig(gain=0.9, offset_levels=2.0)
    assert exposure(0.5, sensor, error).draw((1,)).mean() == pytest.approx(
        4.0 + 2.0 + 0.9 * 251.0 * 0.5, abs=0.2
    )


def test_sixteen_bits_carry_the_same_light_in_finer_steps():
    coarse, fine = (exposure(0.3, SensorConfig(bits=bits)).draw((1,)) for bits in (8, 16))
    assert (coarse.dtype, fine.dtype) == (np.uint8, np.uint16)
    assert fine.mean() / 257.0 == pytest.approx(coarse.mean(), abs=0.1)
    assert len(np.unique(fine)) > 10 * len(np.unique(coarse))


def test_a_full_pixel_stays_full():
    assert (exposure(1.3, SensorConfig(electrons_per_level=1000.0)).draw((1,)) == 255).all()


def test_the_lens_blurs_an_edge_by_its_point_spread():
    light = np.zeros(SHAPE, np.float32)
    light[:, 80:] = 1.0
    sensor = SensorConfig(black_level=0.0)
    row = Exposure.of(light, sensor, ViewErrorConfig(), blur_px=1.5).mean_levels[60]
    spread = np.gradient(row)
    place = np.arange(row.size)
    middle = (spread * place).sum() / spread.sum()
    variance = (spread * (place - middle) ** 2).sum() / spread.sum()
    assert middle == pytest.approx(79.5, abs=1e-3)
    # np.gradient adds 1/2 of its own, the pixel none: the edge lies between two of them.
    assert variance - 0.25 == pytest.approx(1.5**2, rel=0.05)


def test_the_lens_blurs_down_as_it_blurs_across():
    light = np.zeros((90, 90), np.float32)
    light[:, 45:] = 1.0
    sensor = SensorConfig(black_level=0.0)
    across, down = (
        Exposure.of(picture, sensor, ViewErrorConfig(), blur_px=1.5).mean_levels
        for picture in (light, np.ascontiguousarray(light.T))
    )
    assert pytest.approx(across, abs=1e-4) == down.T
