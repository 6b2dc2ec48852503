"""One frame of a capture as robots see it."""

from dataclasses import dataclass

from rig.live.frame import DepthFrame
from rig.recording import DepthImages, Scene
from rig.robots.depth import DepthForRobots
from rig.robots.scene import scene_of
from rig.stored import Run


@dataclass(frozen=True, eq=False, slots=True)
class RobotFrame:
    """What there is beside the pictures."""

    scene: Scene
    depth: DepthImages | None
    """None where slopes are measured only."""


class RobotFrames:
    """Turns the frames of one capture; what stays the same is made with the first of them.

    Args:
        run: the rig.
        points: whether clouds are wanted.
    """

    def __init__(self, run: Run, *, points: bool) -> None:
        self._run = run
        self._points = points
        self._kept: tuple[Scene, DepthForRobots] | None = None

    def of(self, frame: DepthFrame) -> RobotFrame:
        """Return scene and depth of a frame.

        Raises:
            ConfigError: names of the views fit no topics.
        """
        if self._kept is None:
            picture = frame.views.frames[self._run.profile.reference].image
            scene = scene_of(self._run, picture.shape, frame.pinhole)
            self._kept = scene, DepthForRobots(frame.pinhole, points=self._points)
        scene, depth = self._kept
        if frame.depth is None:
            return RobotFrame(scene, None)
        seen = depth.of(frame.depth_mm, frame.sigma_mm, frame.label, frame.colour)
        return RobotFrame(scene, seen)
