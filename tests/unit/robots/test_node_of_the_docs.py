"""The node of docs/how-to/ros-2.md runs, with stand-ins for the libraries that only ROS has."""

import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import rig
from rig.live.frame import DepthFrame
from rig.testing.simulated import open_simulated_rig

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "ros-2.md"


class Message(SimpleNamespace):
    """A message of ROS: fields appear when they are first touched."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        found = Message()
        setattr(self, name, found)
        return found


class Node:
    """The few verbs of rclpy's node that the page uses."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.published: dict[str, list[Any]] = {}
        self.sent: list[Any] = []
        self.fatal: list[str] = []

    def declare_parameter(self, name: str, default: str) -> Any:
        assert (name, default) == ("profile", "my-rig")
        return SimpleNamespace(value="simulated")

    def create_publisher(self, kind: type, topic: str, quality: object) -> Any:
        messages = self.published.setdefault(topic, [])
        return SimpleNamespace(publish=messages.append)

    def get_logger(self) -> Any:
        return SimpleNamespace(fatal=self.fatal.append)

    def destroy_node(self) -> None:
        self.name = ""


class Stopped:
    """Ends the loop after some frames, as closing does."""

    def __init__(self, frames: int) -> None:
        self._camera = open_simulated_rig()
        self._frames = frames
        self.given: list[DepthFrame] = []

    def __enter__(self) -> "Stopped":
        self._camera.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._camera.close()

    def __iter__(self) -> Any:
        for frame, _ in zip(self._camera, range(self._frames), strict=False):
            self.given.append(frame)
            yield frame

    def close(self) -> None:
        self._camera.close()


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The names that the code of the page defines."""

    def library(name: str, **names: Any) -> None:
        module = ModuleType(name)
        module.__dict__.update(names)
        monkeypatch.setitem(sys.modules, name, module)

    spun: list[Any] = []

    def spin(node: Any) -> None:
        spun.append(node)
        node.worker.join()

    library("rclpy", init=lambda: None, spin=spin, try_shutdown=lambda: None)
    library("rclpy.node", Node=Node)
    library("rclpy.qos", qos_profile_sensor_data=object())
    message = {name: type(name, (Message,), {}) for name in ("Image", "CameraInfo")}
    library("sensor_msgs.msg", **message)
    library("geometry_msgs.msg", TransformStamped=type("TransformStamped", (Message,), {}))

    def broadcaster(node: Any) -> Any:
        return SimpleNamespace(sendTransform=node.sent.append)

    library("tf2_ros", StaticTransformBroadcaster=broadcaster)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    names: dict[str, Any] = {"__name__": "depth_node", "spun": spun}
    exec(compile(code, str(PAGE), "exec"), names)  # noqa: S102 - the page's own code
    return names


def test_the_node_publishes_depth_and_its_camera(
    node: dict[str, Any], monkeypatch: pytest.MonkeyPatch
):
    camera = Stopped(2)
    monkeypatch.setattr(rig, "open", lambda profile: camera, raising=False)
    node["main"]()
    (run,) = node["spun"]
    assert run.fatal == []
    assert run.name == ""
    images, infos = run.published["depth/image"], run.published["depth/camera_info"]
    assert len(images) == len(infos) == 2
    for image, info, frame in zip(images, infos, camera.given, strict=True):
        depth_m = np.frombuffer(image.data, "<f4").reshape(image.height, image.width)
        assert depth_m == pytest.approx(frame.depth_mm / 1000.0, rel=1e-6, nan_ok=True)
        assert (image.encoding, image.step) == ("32FC1", 640)
        stamp = image.header.stamp
        assert stamp.sec * 1_000_000_000 + stamp.nanosec == frame.time_ns
        assert image.header.frame_id == info.header.frame_id == "rig_optical_frame"
        assert info.k == frame.camera.matrix.ravel().tolist()
        assert np.reshape(info.p, (3, 4))[:, :3].ravel().tolist() == info.k
        assert (info.height, info.width) == (100, 160)
    (optical,) = run.sent
    assert (optical.header.frame_id, optical.child_frame_id) == ("rig_link", "rig_optical_frame")


def test_the_node_tells_what_ends_it(node: dict[str, Any], monkeypatch: pytest.MonkeyPatch):
    class Gone(Stopped):
        def __iter__(self) -> Any:
            raise rig.errors.DeviceLostError("camera", "is gone", advice="plug it in")

    monkeypatch.setattr(rig, "open", lambda profile: Gone(0), raising=False)
    node["main"]()
    (run,) = node["spun"]
    assert run.fatal == ["camera: is gone; plug it in"]
