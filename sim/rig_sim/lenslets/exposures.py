"""Exposures of the raw picture of a simulated lenslet camera."""

from functools import lru_cache

from rig.errors import ConfigError
from rig.profile import RAW_VIEW, LensletWorldConfig, SimCameraConfig
from rig.profile.world import ViewErrorConfig
from rig_sim.board import Board
from rig_sim.lenslets.light import RawLight
from rig_sim.noise import Exposure, ViewExposure
from rig_sim.world import World

_BOARDS_KEPT = 2


class RawExposures:
    """The latest few raw pictures without noise.

    Args:
        config: the raw camera.
        world: what it looks at.
        lenslets: the array of the world.
    """

    renderer = "closed form"
    """See `rig_sim.pictures.Exposures.renderer`."""
    views = (RAW_VIEW.name,)

    def __init__(self, config: SimCameraConfig, world: World, lenslets: LensletWorldConfig) -> None:
        self._world = world
        self._light = RawLight(world.config, lenslets, world.profile.pitch_mm, config.size_px)
        self._exposed = lru_cache(maxsize=_BOARDS_KEPT)(self._expose)

    def at(self, t_s: float) -> tuple[ViewExposure, ...]:
        """Return the exposure of the raw picture at `t_s`.

        Raises:
            ConfigError: the scene is none that has a closed form.
        """
        if self._world.behind_diffuser:
            return self._exposed(None)
        board = self._world.moment(t_s).board
        if board is None:
            raise ConfigError(
                f"a simulated lenslet camera draws scene board only, asked for {self._world.scene}",
                advice='set world.capture_scene = "board"',
            )
        return self._exposed(board)

    def _expose(self, board: Board | None) -> tuple[ViewExposure, ...]:
        light = self._light.white() if board is None else self._light.of_board(board)
        sensor = self._world.config.sensor
        return (ViewExposure(Exposure.of(light, sensor, ViewErrorConfig(), blur_px=0.0)),)
