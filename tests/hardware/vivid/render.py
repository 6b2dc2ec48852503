"""Pictures for the guest, rendered on the host: the guest's arithmetic is emulated and slow."""

from pathlib import Path
from typing import cast

import numpy as np
from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock
from rig_sim.world import World

from rig.frames import GreyImage
from rig.profile import SimCameraConfig
from tests.hardware.vivid.sweep_bench import VARIANTS, places_mm, simulated_profile, stops
from tests.support.cameras import Slide, SmallRig


def render_all(folder: Path) -> None:
    """Write everything that the guest's cameras are to see."""
    np.save(folder / "board.npy", board_pictures())
    np.save(folder / "sweep.npy", sweep_pictures())
    np.save(folder / "pair.npy", pair_of_pictures())


def board_pictures() -> GreyImage:
    """Return what the simulated rig's reference view sees of its board at two places."""
    rig = SmallRig(("camera.width_px=640", "camera.height_px=480"))
    pictures: list[GreyImage] = []
    with rig.camera() as camera:
        for at_mm in (-603.0, -500.0):
            rig.slide.at_mm = at_mm
            pictures.append(camera.grab(1.0).frames[0].image)
    return cast("GreyImage", np.stack(pictures))


def pair_of_pictures() -> GreyImage:
    """Return what two views see of the board, (2, H, W), half as wide as a camera gives them."""
    rig = SmallRig(("camera.width_px=320", "camera.height_px=480", "world.optics.focal_px=305.0"))
    with rig.camera() as camera:
        return cast("GreyImage", np.stack(camera.grab(1.0).images[:2]))


def sweep_pictures() -> GreyImage:
    """Return what all views of the sweep's rig see at its stops, (stops, variants, V, H, W)."""
    profile, slide, clock = simulated_profile(), Slide(), VirtualClock()
    world = World(profile, clock=clock, carriage=slide, scene="board")
    assert isinstance(profile.camera, SimCameraConfig)
    found: list[GreyImage] = []
    with SimCamera(profile.camera, world) as camera:
        for slide.at_mm in places_mm(profile, stops()):
            found.extend(
                cast("GreyImage", np.stack(camera.grab(1.0).images)) for _ in range(VARIANTS)
            )
    stacked = np.stack(found)
    return cast("GreyImage", stacked.reshape(-1, VARIANTS, *stacked.shape[1:]))
