"""From light to grey levels: point spread, shot and read noise, gain, quantisation."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import ColourImage, GreyImage
from rig.profile.world import SensorConfig, ViewErrorConfig

Picture = NDArray[np.float32]

_FULL_LEVELS = 255.0


@dataclass(frozen=True, slots=True)
class Exposure:
    """Expected grey level of every pixel and its noise, in levels of the delivered image."""

    mean_levels: Picture
    sigma_levels: Picture
    bits: int

    @classmethod
    def of(
        cls, light: Picture, sensor: SensorConfig, error: ViewErrorConfig, *, blur_px: float
    ) -> "Exposure":
        """Expose one view to sharp light (H, W), 1 = full scale, through a Gaussian point spread.

        The noise model is the photon transfer curve: variance = signal / electrons per level
        + read noise squared (J. R. Janesick, "Photon Transfer", SPIE 2007).
        """
        if blur_px > 0.0:
            light = cv2.GaussianBlur(light, (0, 0), blur_px).astype(np.float32, copy=False)
        signal_levels = error.gain * (_FULL_LEVELS - sensor.black_level) * light
        sigma_levels = np.sqrt(
            signal_levels / sensor.electrons_per_level + sensor.read_noise_levels**2
        )
        mean_levels = signal_levels + (sensor.black_level + error.offset_levels)
        scale = _full_scale(sensor.bits) / _FULL_LEVELS
        return cls(
            (mean_levels * scale).astype(np.float32),
            (sigma_levels * scale).astype(np.float32),
            sensor.bits,
        )

    def draw(self, seed: tuple[int, ...]) -> GreyImage:
        """Draw one noisy image; the same seed gives the same image."""
        generator = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed)))
        levels = generator.standard_normal(self.mean_levels.shape, dtype=np.float32)
        levels *= self.sigma_levels
        levels += self.mean_levels
        np.rint(levels, out=levels)
        np.clip(levels, 0.0, _full_scale(self.bits), out=levels)  # a full well or an empty one
        return levels.astype(np.uint8) if self.bits == 8 else levels.astype(np.uint16)


@dataclass(frozen=True, slots=True)
class ViewExposure:
    """What one view sees of a moment."""

    grey: Exposure
    channels: tuple[Exposure, ...] = ()
    """Red, green and blue; none for a grey camera."""

    def colour(self, seed: tuple[int, ...]) -> ColourImage | None:
        """Draw one noisy picture in colour, its upper eight bits; None for a grey camera."""
        if not self.channels:
            return None
        drawn = [one.draw((*seed, number)) for number, one in enumerate(self.channels)]
        return (np.stack(drawn, axis=-1) >> (self.grey.bits - 8)).astype(np.uint8)


def _full_scale(bits: int) -> float:
    return float(2**bits - 1)
