"""Sweeps in closed form: slopes of a known law, as exact or as noisy as a test wants them."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from rig.curve import CurvePoint

Z0_MM, A_PX_MM, M_INF_PX = 3.0, 24_000.0, -34.0
FOCUS_MM = Z0_MM - A_PX_MM / M_INF_PX
DISTANCES_MM = np.linspace(400.0, 1200.0, 17)


def physical_px(distance_mm: float) -> float:
    """Slope of an ideal rig."""
    return M_INF_PX + A_PX_MM / (distance_mm - Z0_MM)


def distorted_px(distance_mm: float) -> float:
    """The same rig with an uncorrected lens: a disparity error that goes with 1 / Z^3."""
    return physical_px(distance_mm) + 2.0 * (400.0 / distance_mm) ** 3


def wavy_px(distance_mm: float) -> float:
    """A rig that no smooth law describes."""
    return physical_px(distance_mm) + 0.5 * float(np.sin(distance_mm / 80.0))


def make_point(distance_mm: float, slope_px: float, **changes: object) -> CurvePoint:
    """One noiseless forward stop of the fit; `changes` replace its fields."""
    point = CurvePoint(distance_mm, slope_px, 0.0, 0.0, 5, "fit", "forward")
    return replace(point, **changes)  # pyright: ignore[reportArgumentType]  # fields by name


def exact_sweep(
    law: Callable[[float], float] = physical_px,
    distances_mm: Iterable[float] = DISTANCES_MM,
    *,
    hold_out: bool = True,
) -> list[CurvePoint]:
    """Noiseless stops; every fourth is held out."""
    return [
        make_point(float(z), law(float(z)), role="holdout" if hold_out and i % 4 == 2 else "fit")
        for i, z in enumerate(distances_mm)
    ]


def noisy_sweep(
    law: Callable[[float], float] = physical_px,
    distances_mm: Iterable[float] = DISTANCES_MM,
    *,
    seed: int,
    sample_px: float = 0.01,
    stop_px: float = 0.005,
    samples: int = 5,
) -> list[CurvePoint]:
    """Stops with noise of every sample and scatter of every stop; every third is visited twice."""
    random = np.random.default_rng(seed)
    points: list[CurvePoint] = []
    for i, z in enumerate(distances_mm):
        role = "holdout" if i % 4 == 2 else "fit"
        for direction in ("forward", "backward")[: 2 if i % 3 == 0 else 1]:
            slopes_px = law(float(z)) + stop_px * random.normal()
            slopes_px = slopes_px + sample_px * random.normal(size=samples)
            std_px = float(slopes_px.std(ddof=1))
            points.append(
                CurvePoint(
                    float(z),
                    float(slopes_px.mean()),
                    std_px,
                    std_px / samples**0.5,
                    samples,
                    role,
                    direction,
                )
            )
    return points
