"""The door to mitsuba: traces the light of a scene to the sensors of the true cameras.

Surfaces give off the light that their textures hold: a picture needs one segment per ray and has
no Monte-Carlo noise but that of anti-aliasing.
"""

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError
from rig_sim.board import Board
from rig_sim.optics import TrueCamera
from rig_sim.resample import FINER, Lens, Pinhole
from rig_sim.scenes.catalogue import Scene, static_surfaces
from rig_sim.surface import FLAT, Kind, Surface
from rig_sim.window import Window
from rig_sim.world import Moment

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

_VARIANT = "scalar_rgb"
"""It runs on every machine. With one segment per ray the LLVM variants would gain nothing: they
compile a program for every size of picture."""
_NEAR_M, _FAR_M = 1e-3, 100.0
_M_PER_MM = np.diag([1e-3, 1e-3, 1e-3, 1.0])
"""mitsuba works in float32 with absolute tolerances made for scenes of about one unit."""
_SAMPLES_BEHIND_BOARD = 4
"""Soft surroundings need no more rays per pixel."""


class MitsubaRenderer:
    """Renders every scene.

    Args:
        samples_per_px: rays through every pixel.
        seed: of the places of the rays inside the pixels.

    Raises:
        ConfigError: mitsuba is not installed.
    """

    def __init__(self, *, samples_per_px: int, seed: int) -> None:
        self._mi = _open_mitsuba()
        self._samples_per_px = samples_per_px
        self._seed = seed
        self._static: dict[Scene, Any] = {}
        self._behind: tuple[tuple[TrueCamera, ...], list[Picture]] = ((), [])
        version = f"mitsuba {self._mi.__version__}"
        self.name = f"{version}, {samples_per_px} samples per px, seed {seed}"

    def render(self, moment: Moment) -> tuple[Picture, ...]:
        """See `rig_sim.pictures.Renderer`."""
        if moment.board is None:
            return tuple(self._surroundings(moment, self._samples_per_px))
        if self._behind[0] != moment.cameras:
            samples = min(self._samples_per_px, _SAMPLES_BEHIND_BOARD)
            self._behind = moment.cameras, self._surroundings(moment, samples)
        board = self._load([self._board(moment.board)])
        return tuple(
            self._lay_over(behind, board, camera, Window.of_board(camera, moment.board))
            for behind, camera in zip(self._behind[1], moment.cameras, strict=True)
        )

    def _surroundings(self, moment: Moment, samples_per_px: int) -> list[Picture]:
        scene = moment.scene
        if scene not in self._static:
            self._static[scene] = self._load([self._emit(s) for s in static_surfaces(scene)])
        return [
            self._trace(self._static[scene], camera, Window.whole(camera), samples_per_px)[..., 0]
            for camera in moment.cameras
        ]

    def _lay_over(self, behind: Picture, board: Any, camera: TrueCamera, window: Window) -> Picture:
        if window.is_empty:
            return behind
        traced = self._trace(board, camera, window, self._samples_per_px)
        picture = behind.copy()
        picture[window.pixels] *= 1.0 - traced[..., 1]
        picture[window.pixels] += traced[..., 0]
        return picture

    def _trace(
        self, scene: Any, camera: TrueCamera, window: Window, samples_per_px: int
    ) -> Picture:
        """Return light times cover, and cover: (H, W, 2)."""
        lens = Lens(camera, window)
        if camera.distorts:
            samples_per_px = max(1, samples_per_px // FINER**2)
        sensor = self._mi.load_dict(self._sensor(camera, lens.pinhole))
        traced = self._mi.render(scene, sensor=sensor, spp=samples_per_px, seed=self._seed)
        return lens.through(np.array(traced, np.float32)[..., (0, -1)])

    def _sensor(self, camera: TrueCamera, pinhole: Pinhole) -> dict[str, Any]:
        width_px, height_px = pinhole.width_px, pinhole.height_px
        half_width = width_px / 2.0 / pinhole.focal_px
        world_from_cam = np.eye(4)
        # mitsuba's camera looks along +z with x to the left and y up.
        world_from_cam[:3, :3] = camera.rotation @ np.diag([-1.0, -1.0, 1.0])
        world_from_cam[:3, 3] = np.asarray(camera.position_mm) * 1e-3
        return {
            "type": "perspective",
            "fov": float(np.degrees(2.0 * np.arctan(half_width))),
            "fov_axis": "x",
            "principal_point_offset_x": 0.5 - (pinhole.centre_px[0] + 0.5) / width_px,
            "principal_point_offset_y": 0.5 - (pinhole.centre_px[1] + 0.5) / height_px,
            "near_clip": _NEAR_M,
            "far_clip": _FAR_M,
            "to_world": self._mi.ScalarTransform4f(world_from_cam),
            "sampler": {"type": "multijitter"},
            "film": {
                "type": "hdrfilm",
                "width": width_px,
                "height": height_px,
                "pixel_format": "rgba",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
        }

    def _load(self, shapes: list[dict[str, Any]]) -> Any:
        numbered = {f"surface_{number}": shape for number, shape in enumerate(shapes)}
        # max_depth 1: only the light that a surface gives off by itself.
        integrator = {"type": "path", "max_depth": 1}
        return self._mi.load_dict({"type": "scene", "integrator": integrator, **numbered})

    def _emit(self, surface: Surface) -> dict[str, Any]:
        return self._shape(
            surface.shape.kind,
            surface.shape.world_from_unit,
            {"bitmap": self._mi.Bitmap(surface.texture[:, :, None]), "filter_type": "bilinear"},
        )

    def _board(self, board: Board) -> dict[str, Any]:
        """Nearest texels give exact edges; the margin lies in the texture's outer ring."""
        ring = np.pad(board.texels, 1, constant_values=board.margin_light)
        ring_rows, ring_columns = ring.shape
        size = 2.0 * board.half_size_mm / board.texel_mm / (ring_columns, ring_rows)
        start = (1.0 - board.margin_mm / board.texel_mm) / np.array([ring_columns, ring_rows])
        to_uv = self._mi.ScalarTransform4f().translate([*start, 0.0]).scale([*size, 1.0])
        texture = {
            "bitmap": self._mi.Bitmap(ring[:, :, None]),
            "filter_type": "nearest",
            "to_uv": to_uv,
        }
        return self._shape("rectangle", board.shape().world_from_unit, texture)

    def _shape(self, kind: Kind, world_from_unit: Array, texture: dict[str, Any]) -> dict[str, Any]:
        radiance = {"type": "bitmap", "raw": True, "wrap_mode": "clamp", **texture}
        return {
            "type": kind,
            "to_world": self._mi.ScalarTransform4f(_M_PER_MM @ world_from_unit),
            "flip_normals": kind in FLAT,
            "emitter": {"type": "area", "radiance": radiance},
        }


def _open_mitsuba() -> Any:
    """Import mitsuba, which is an extra and takes a second to import."""
    try:
        mitsuba = importlib.import_module("mitsuba")
    except ImportError as error:
        raise ConfigError(
            f"the simulated camera renders with mitsuba, which is not installed ({error})",
            advice="run: pip install 'epirig[sim]'",
        ) from error
    mitsuba.set_variant(_VARIANT)
    return mitsuba
