"""The stitched plane of every pixel beside a weighted least-squares fit of its own."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.behind import behind_jumps
from rig.epipolar.stitch import stitch

Map = NDArray[np.float32]
RNG = np.random.default_rng(11)
# Wider than the block whose sums are kept together.
SHAPE = (9, 140)
SLOPE_GATE_PX, GREY_GATE = 0.8, 15.0


def plain_fit(
    maps: tuple[Map, Map, Map, Map], v: int, u: int, radius_px: int, stride_px: int
) -> tuple[float, float, float]:
    """Slope, variance and misfit of one pixel; around the picture all maps are 0."""
    slope, line, information, grey = (np.pad(one.astype(float), radius_px) for one in maps)
    design, weights, values, gates = [], [], [], 0.0
    for dy in range(-radius_px, radius_px + 1):
        for dx in range(-radius_px, radius_px + 1):
            if dy**2 + dx**2 > (radius_px + 0.5) ** 2 or (dy + dx) % stride_px:
                continue
            there, here = (v + dy + radius_px, u + dx + radius_px), (v + radius_px, u + radius_px)
            near = max(1 - ((slope[there] - slope[here]) / SLOPE_GATE_PX) ** 2, 0) ** 2
            gate = near / (1 + ((grey[there] - grey[here]) / GREY_GATE) ** 2) ** 2
            gates += gate
            design.append([1, dx, dy])
            weights.append(gate * information[there])
            values.append(line[there] - slope[here])
    a, w, m = np.array(design), np.array(weights), np.array(values)
    normal = a.T @ (w[:, None] * a)
    found = np.linalg.solve(normal, a.T @ (w * m))
    rest = float(w @ (m - a @ found) ** 2)
    here_px = float(maps[0][v, u])
    return here_px + found[0], float(np.linalg.inv(normal)[0, 0]), rest / gates


@pytest.mark.parametrize("stride_px", [1, 2])
@pytest.mark.parametrize("offset_px", [0.0, 30.0], ids=["near-0", "far-from-0"])
def test_every_pixel_is_a_weighted_plane(stride_px: int, offset_px: float):
    slope, noise = RNG.normal(offset_px, 0.3, SHAPE), RNG.normal(0.0, 0.4, SHAPE)
    maps = (
        slope.astype(np.float32),
        (slope + noise).astype(np.float32),
        RNG.uniform(0.5, 9.0, SHAPE).astype(np.float32),
        RNG.uniform(0.0, 60.0, SHAPE).astype(np.float32),
    )
    found = stitch(
        *maps, radius_px=3, stride_px=stride_px, slope_gate_px=SLOPE_GATE_PX, grey_gate=GREY_GATE
    )
    places = [(0, 0), (0, 139), (8, 0), (8, 139), (4, 127), (4, 128), (3, 60), (5, 7), (8, 77)]
    for v, u in places:
        expected = plain_fit(maps, v, u, 3, stride_px)
        told = [float(one[v, u]) for one in found]
        assert told[0] == pytest.approx(expected[0], abs=2e-4)
        assert told[1:] == pytest.approx(expected[1:], rel=2e-3)


def test_a_lone_line_tells_no_plane():
    nothing = np.zeros(SHAPE, np.float32)
    alone = nothing.copy()
    alone[4, 50] = 4.0
    line = np.full(SHAPE, 0.5, np.float32)
    slope, variance, misfit = stitch(
        nothing, line, alone, nothing, radius_px=3, stride_px=1, slope_gate_px=0.8, grey_gate=9.0
    )
    assert not slope.any()
    assert np.isinf(variance).all()
    assert not misfit.any()


def test_only_pixels_beside_a_slope_that_is_larger_by_the_jump_lose_their_say():
    slope = np.array([[0.0, 0.0, 0.0, 1.0, 1.0, 2.5]], np.float32)
    information = np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]], np.float32)
    left = behind_jumps(slope, information, 1.0)
    assert left[0] == pytest.approx([1.0, 2.0, 3.0, 4.0, 0.1, 6.0])
    assert behind_jumps(slope, information, 0.99)[0, 2] == pytest.approx(0.06)
