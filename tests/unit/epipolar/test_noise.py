import numpy as np
import pytest

from rig.epipolar.noise.white import noise_grey
from rig.epipolar.scales import measure_scales, noise_of, stabilise
from tests.support.lightfield import noise_texture

RNG = np.random.default_rng(8)
ROWS, COLUMNS = np.mgrid[0:200, 0:240].astype(float)


@pytest.mark.parametrize("sigma", [0.5, 2.0, 8.0])
def test_white_noise_on_a_ramp_is_measured(sigma: float) -> None:
    image = 50 + 0.3 * COLUMNS + 0.2 * ROWS + sigma * RNG.standard_normal(ROWS.shape)
    assert noise_grey(image.astype(np.float32)) == pytest.approx(sigma, rel=0.08)


def test_texture_does_not_count_as_noise() -> None:
    texture = noise_texture(3, mean=120, contrast=25, finest_px=3.0)(COLUMNS, ROWS)
    noisy = texture + 2.0 * RNG.standard_normal(ROWS.shape)
    assert noise_grey(noisy.astype(np.float32)) == pytest.approx(2.0, rel=0.25)


def test_a_flat_image_has_no_noise() -> None:
    assert noise_grey(np.full((40, 40), 7.0, np.float32)) == 0.0


def test_the_prefilter_grows_with_noise_and_is_off_for_clean_images() -> None:
    texture = noise_texture(3, mean=120, contrast=25, finest_px=3.0)(COLUMNS, ROWS)
    widths: list[float] = []
    for sigma in (0.0, 2.0, 6.0):
        noisy = texture + sigma * RNG.standard_normal(ROWS.shape)
        widths.append(measure_scales(noisy[None].astype(np.float32), 0).prefilter_px)
    assert widths[0] == 0.0
    assert 0.0 < widths[1] < widths[2]


def test_rounding_counts_as_noise_where_nothing_else_does() -> None:
    ramp = np.rint(50 + 0.05 * COLUMNS).astype(np.float32)
    model = noise_of(ramp[None], 1.0, None)
    assert stabilise(ramp[None], 0, model, is_told=False)[1].scales.noise >= 1 / 12**0.5 - 1e-9


def test_clipped_pixels_do_not_make_an_image_quiet() -> None:
    noisy = 200 + 30 * np.sin(COLUMNS / 40) + 4.0 * RNG.standard_normal(ROWS.shape)
    clipped = np.minimum(noisy, 215.0).astype(np.float32)
    assert noise_grey(clipped) == pytest.approx(4.0, rel=0.1)
