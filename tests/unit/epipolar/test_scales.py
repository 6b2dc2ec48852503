import numpy as np

from rig.epipolar.scales import measure_scales
from tests.support.lightfield import noise_texture


def test_a_few_strong_edges_do_not_leave_weak_texture_unfiltered() -> None:
    rng = np.random.default_rng(1)
    v, u = np.mgrid[0:128, 0:128].astype(float)
    weak = noise_texture(1, mean=90.0, contrast=4.0, finest_px=2.5)(u, v)
    noisy = (weak + rng.standard_normal(weak.shape)).astype(np.float32)
    edges = noisy.copy()
    edges[40:60, 30:90] += 60.0
    alone, beside = (measure_scales(image[None], 0) for image in (noisy, edges))
    assert beside.texture > 3.0 * alone.texture
    assert beside.prefilter_px > 0.5 * alone.prefilter_px > 0.3
