"""What robots and recorders cost: `python -m benchmarks.robots`.

Processor time of one frame of five calibrated views of 640 x 400 and its depth, medians, all ways
interleaved in one process; memory over many small frames. The client of the server runs in a
process of its own.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from rig.capture.output import Output
from rig.capture.recording import CaptureRecording
from rig.depth import DepthMap
from rig.epipolar import SlopeMap
from rig.frames import Frame, MultiView
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.profile.load import load_profile
from rig.robots.foxglove_server import FoxgloveServer
from rig.robots.ros2_recording import Ros2Recording
from rig.stored import Run
from rig.testing.simulated import PROFILE

GOAL_MS = 8.0
_PAGE_BYTES = 4096
_CLIENT = """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
    asked = 0
    for message in socket:
        if isinstance(message, str) and json.loads(message)["op"] == "advertise":
            channels = json.loads(message)["channels"]
            wanted = [{"id": asked + n, "channelId": c["id"]} for n, c in enumerate(channels)]
            asked += len(wanted)
            socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
"""


class Opened:
    """As much of an opened camera as outputs ask for."""

    identity: ClassVar[dict[str, str]] = {"kind": "benchmark"}

    def __init__(self, width_px: int, height_px: int) -> None:
        profile = load_profile(str(PROFILE))
        cameras = tuple(
            CameraModel(
                width_px,
                height_px,
                0.95 * width_px,
                0.95 * width_px,
                width_px / 2,
                height_px / 2,
                "brown5",
                (-0.05, 0.01, 0.001, -0.0005, 0.0),
            )
            for _ in profile.views
        )
        turn = Pose.from_vectors(np.array([0.01, 0.02, 0.0]), np.zeros(3)).rotation
        poses = tuple(
            Pose(np.eye(3), -turn @ np.array([40.0 * view.x_steps, 40.0 * view.y_steps, 0.0]))
            for view in profile.views
        )
        geometry = RigGeometry(tuple(v.name for v in profile.views), 0, cameras, poses)
        self.optics: CalibratedOptics = calibrated_optics(profile, geometry, 1)
        self.run = Run(profile, self.optics)
        self.views = geometry.names

    def frame(self, number: int) -> DepthFrame:
        """Return a frame of noise."""
        pinhole = self.optics.rectification.pinhole
        shape = (pinhole.height_px, pinhole.width_px)
        random = np.random.default_rng(number)
        images = random.integers(0, 256, (len(self.views), *shape)).astype(np.uint8)
        depth_mm: NDArray[np.float32] = random.uniform(500, 2000, shape).astype(np.float32)
        depth_mm[random.random(shape) < 0.1] = np.nan
        label = np.isfinite(depth_mm).astype(np.uint8)
        multiview = MultiView(
            tuple(Frame(v, i, 1.0, number) for v, i in zip(self.views, images, strict=True))
        )
        time_ns = 1_700_000_000_000_000_000 + 50_000_000 * number
        return DepthFrame(
            index=number,
            views=multiview,
            slopes=SlopeMap(depth_mm, depth_mm, label),
            image=images[0],
            time_ns=time_ns,
            latency_s=0.0,
            rig="benchmark",
            depth=DepthMap(depth_mm, depth_mm / np.float32(100), label),
            pinhole=pinhole,
        )


class _PlainFile:
    """What the system takes for the bytes of a frame alone."""

    name = "plain"

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb", buffering=0)
        self._content = bytes(3_800_000)

    def write(self, frame: DepthFrame) -> None:
        del frame
        self._file.write(self._content)

    def close(self) -> None:
        self._file.close()


@contextmanager
def outputs(camera: Opened, folder: Path) -> Generator[dict[str, Output]]:
    """Open every way out, with and without the cloud; beside them a file of as many bytes."""
    opened = cast("DepthCamera", camera)
    with ExitStack() as stack:
        found: dict[str, Output] = {"plain file of 3.8 MB": _PlainFile(folder / "plain")}
        for name, points in (("", False), (" with points", True)):
            recording = CaptureRecording(folder / f"f{points}.mcap", opened, points=points)
            found[f"recording Foxglove{name}"] = recording
            found[f"recording ROS 2{name}"] = Ros2Recording(
                folder / f"r{points}.mcap", opened, points=points
            )
        found["serving, no client"] = FoxgloveServer(opened, port=0)
        server = FoxgloveServer(opened, port=0)
        found["serving, one client"] = server
        for output in found.values():
            stack.callback(output.close)
        address = f"ws://127.0.0.1:{server.port}"
        client = subprocess.Popen([sys.executable, "-c", _CLIENT, address])
        stack.callback(client.wait)
        stack.callback(client.terminate)
        server.write(camera.frame(0))
        time.sleep(2.0)  # until the client has asked for all topics
        yield found


def processor_ms(frames: int) -> dict[str, float]:
    """Median over frames; the frame is made outside of the time."""
    camera = Opened(640, 400)
    taken: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder, outputs(camera, Path(folder)) as ways:
        for number in range(frames + 3):
            frame = camera.frame(number)
            for name, output in ways.items():
                begun_s = time.process_time()
                output.write(frame)
                if name.startswith("serving"):
                    time.sleep(0.02)  # the server's own threads send meanwhile
                taken.setdefault(name, []).append(1e3 * (time.process_time() - begun_s))
    return {name: statistics.median(times[3:]) for name, times in taken.items()}


def memory_per_frame(kind: Any, frames: int) -> float:
    """Slope of the resident memory, bytes a frame, behind the first fifth."""
    camera = Opened(32, 20)
    frame = camera.frame(0)
    rows: list[tuple[int, int]] = []
    with tempfile.TemporaryDirectory() as folder:
        output = kind(Path(folder) / "r.mcap", cast("DepthCamera", camera))
        for number in range(frames):
            output.write(frame)
            if number > frames // 5 and number % 100 == 0:
                resident = int(Path("/proc/self/statm").read_text().split()[1])
                rows.append((number, resident * _PAGE_BYTES))
        output.close()
    at, resident = np.array(rows, np.float64).T
    return float(np.polyfit(at, resident, 1)[0])


def main() -> int:
    """Measure and print; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--small-frames", type=int, default=10_000)
    asked = parser.parse_args()
    times_ms = processor_ms(asked.frames)
    memory = {
        name: memory_per_frame(kind, asked.small_frames)
        for name, kind in (("Foxglove", CaptureRecording), ("ROS 2", Ros2Recording))
    }
    print(json.dumps({"processor_ms": times_ms, "memory_bytes_a_frame": memory}, indent=2))
    recordings = {
        n: t for n, t in times_ms.items() if n in ("recording Foxglove", "recording ROS 2")
    }
    return 0 if max(recordings.values()) <= GOAL_MS else 1


if __name__ == "__main__":
    sys.exit(main())
