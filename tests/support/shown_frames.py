"""Frames of a scene in closed form, to show and to send: no estimator, no renderer."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.depth import DepthMap
from rig.epipolar import SlopeMap
from rig.frames import Frame, MultiView
from rig.geometry.pinhole import Pinhole
from rig.live.frame import DepthFrame
from rig.stored import Run
from rig.testing.simulated import open_simulated_rig

FOCUS_MM = 1000.0
SPHERE_MM, RADIUS_MM = 780.0, 130.0
WALL_MM, FLOOR_MM = 1150.0, 190.0


@dataclass(frozen=True)
class Scene:
    """A ball before a wall over a floor, all of it measured with some noise."""

    run: Run
    width: int
    height: int

    @property
    def focal_px(self) -> float:
        return 0.95 * self.width

    def depth_mm(self, sway_mm: float) -> NDArray[np.float64]:
        """Depth of the ball, `sway_mm` right of the axis, the slanted wall and the floor."""
        y, x = np.indices((self.height, self.width), np.float64)
        right = (x - self.width / 2) / self.focal_px
        down = (y - self.height / 2) / self.focal_px
        wall = WALL_MM / (1.0 + 0.12 * right)
        with np.errstate(divide="ignore"):
            floor = np.where(down > 0.0, FLOOR_MM / down, np.inf)
        # |t (right, down, 1) - (sway, 0, sphere)| = radius, the nearer t
        a = right**2 + down**2 + 1.0
        b = right * sway_mm + SPHERE_MM
        c = sway_mm**2 + SPHERE_MM**2 - RADIUS_MM**2
        root = b**2 - a * c
        ball = np.where(root > 0.0, (b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)
        return np.minimum(np.minimum(wall, floor), ball)

    def frame(self, index: int, *, sway_mm: float = 0.0, has_depth: bool = True) -> DepthFrame:
        """Frame `index`; about a twentieth of it has no answer."""
        rng = np.random.default_rng(index)
        true_mm = self.depth_mm(sway_mm)
        scale = self.focal_px * self.run.profile.pitch_mm
        slope = scale * (1.0 / true_mm - 1.0 / FOCUS_MM)
        sigma_px = np.full(slope.shape, 0.03) * (1.0 + rng.random(slope.shape))
        slope = slope + sigma_px * rng.standard_normal(slope.shape)
        label = np.where(slope > 0.0, 1, 2).astype(np.uint8)
        label[_spots(rng, slope.shape)] = 0
        label[np.abs(np.gradient(true_mm, axis=1)) > 30.0] = 3
        slope_px = np.where(label > 0, slope, np.nan).astype(np.float32)
        depth_mm = (1.0 / (slope_px / scale + 1.0 / FOCUS_MM)).astype(np.float32)
        sigma_mm = (sigma_px * depth_mm**2 / scale).astype(np.float32)
        views = self._views(index, true_mm, scale)
        reference = self.run.profile.reference
        pinhole = Pinhole(
            self.width,
            self.height,
            self.focal_px,
            (self.width / 2, self.height / 2),
            np.eye(3),
        )
        sigma = np.where(label > 0, sigma_px, np.nan).astype(np.float32)
        return DepthFrame(
            index=index,
            views=views,
            slopes=SlopeMap(slope_px, sigma, label),
            image=views.frames[reference].image,
            time_ns=1_790_000_000_000_000_000 + 50_000_000 * index,
            latency_s=0.032,
            measuring_s=0.021,
            rig=self.run.profile.name,
            depth=DepthMap(depth_mm, sigma_mm, label) if has_depth else None,
            pinhole=pinhole if has_depth else None,
        )

    def _views(self, index: int, true_mm: NDArray[np.float64], scale: float) -> MultiView:
        slope = scale * (1.0 / true_mm - 1.0 / FOCUS_MM)
        y, x = np.indices(true_mm.shape, np.float64)
        optics, frames = self.run.optics, list[Frame]()
        for name, x_step, y_step in zip(
            [view.name for view in self.run.profile.views],
            optics.x_steps,
            optics.y_steps,
            strict=True,
        ):
            # What shows at a pixel of this view is about `slope * step` beside it in the reference.
            right, down = x + slope * x_step, y + slope * y_step
            grey = (
                118.0
                + 60.0 * np.sin(right / 5.1) * np.sin(down / 6.3)
                + 55.0 * np.sin(right / 23.0 + 2.0 * np.sin(down / 17.0))
            )
            grey += 2.0 * np.random.default_rng(index).standard_normal(grey.shape)
            image = np.clip(np.rint(grey * (1.05 + 0.1 * x_step)), 0, 255).astype(np.uint8)
            frames.append(Frame(name, image, 10.0 + 0.05 * index, index, exposure_s=0.008))
        return MultiView(tuple(frames), temperature_degc=36.5)


def _spots(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    side = max(4, shape[1] // 80)
    coarse = rng.random((shape[0] // side + 1, shape[1] // side + 1)) < 0.05
    return np.kron(coarse, np.ones((side, side), bool))[: shape[0], : shape[1]]


def scene(width: int = 64, height: int = 40) -> Scene:
    """The scene as the simulated rig for other people's tests would see it, five views."""
    return Scene(open_simulated_rig().run, width, height)
