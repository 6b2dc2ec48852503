"""The simulated camera as a kind of camera."""

from typing import TYPE_CHECKING, cast

from rig.devices import Camera
from rig.profile import SimCameraConfig
from rig.profile.kinds import CameraKind, Surroundings

if TYPE_CHECKING:
    from rig_sim.bench import SimulatedBench


def _open(config: SimCameraConfig, around: Surroundings) -> Camera:
    from rig_sim.camera import SimCamera

    world = cast("SimulatedBench", around.simulated).world
    lenslets = world.config.lenslets
    if lenslets is None:
        return SimCamera(config, world)
    from rig_sim.lenslets.exposures import RawExposures

    return SimCamera(config, world, RawExposures(config, world, lenslets))


SIM = CameraKind(contract=1, name="sim", config=SimCameraConfig, open=_open)
