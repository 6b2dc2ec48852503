"""The taking part of `rig sweep` over V4L2 cameras and a GRBL stage, each behind its own driver.

The host rendered what the cameras see; it stores and measures what they gave
(`test_measured_on_host`), because the guest's arithmetic is emulated and slow.
"""

import json
import queue
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from rig_sim.carriage import Carriage
from rig_sim.firmware.grbl import GrblFirmware
from rig_sim.wire.serve import serve_on_pty

from rig.devices import SystemClock
from rig.hardware.opening import open_hardware
from rig.recording import RecordingWriter
from rig.sweep.take import SweepTimes, run_sweep
from tests.hardware.vivid.bench import (
    capture_path,
    output_path,
    set_control,
    use_loop,
    use_webcam,
)
from tests.hardware.vivid.guest import RESULTS
from tests.hardware.vivid.output import VideoOutput
from tests.hardware.vivid.sweep_bench import (
    SIZE_PX,
    VIEWS,
    Screens,
    camera_profile,
    load_pictures,
    places_mm,
    simulated_profile,
    stops,
)

pytestmark = pytest.mark.slow


def stage_port(carriage: Carriage) -> str:
    """Return the port of a simulated stage that moves the carriage, in real time."""
    world = simulated_profile().world
    assert world is not None
    firmware = GrblFirmware(world.firmware, carriage, SystemClock())
    ready: queue.Queue[str] = queue.Queue()
    serve = threading.Thread(
        target=serve_on_pty, args=(firmware,), kwargs={"on_ready": ready.put}, daemon=True
    )
    serve.start()
    return ready.get(timeout=10.0)


def test_every_sample_of_a_sweep_comes_through_the_kernel_as_it_was_rendered():
    truth, halts, pictures = simulated_profile(), stops(), load_pictures(Path(RESULTS))
    assert truth.world is not None
    carriage = Carriage(truth.world.carriage, SystemClock())
    devices = {view: str(capture_path(number)) for number, view in enumerate(VIEWS)}
    profile = camera_profile(stage_port(carriage), devices)
    assert profile.sweep is not None
    samples: list[tuple[int, int, float]] = []
    with ExitStack() as bench:
        outputs: list[VideoOutput] = []
        for number in range(len(VIEWS)):
            use_loop(number, "index=0")
            bench.callback(use_webcam, number)
            # The line runs at 60 Hz, which is more than an emulated processor can take in.
            set_control(number, "percentage_of_dropped_buffers", 75)
            bench.callback(set_control, number, "percentage_of_dropped_buffers", 0)
            output = VideoOutput(output_path(number), width_px=SIZE_PX[0], height_px=SIZE_PX[1])
            outputs.append(bench.enter_context(output))
        screens = Screens(outputs, pictures, carriage, places_mm(truth, halts))
        hardware = bench.enter_context(open_hardware(profile))
        hardware.stage.home()
        camera = hardware.camera
        recording = bench.enter_context(
            RecordingWriter(Path(RESULTS, "sweep.mcap"), camera.views, camera.identity)
        )
        for new in run_sweep(
            halts,
            stage=hardware.stage,
            camera=camera,
            clock=hardware.clock,
            samples=profile.sweep.samples,
            settle_s=profile.sweep.settle_s,
            move_timeout_s=30.0,
            grab_timeout_s=profile.camera.timeout_s,
            times=SweepTimes(),
            deferred=screens.deferred,
        ):
            for number, frame in enumerate(new.multiview.frames):
                shown = pictures[new.stop.index, :, number]
                assert any(np.array_equal(frame.image, picture) for picture in shown), (
                    f"{frame.view} at {new.stop.distance_mm} mm is no picture of this stop"
                )
            recording.write(new.multiview, time.time_ns())
            samples.append((new.stop.index, new.sample, new.reached_mm))
    assert [stop for stop, _, _ in samples] == [i for i in range(len(halts)) for _ in range(2)]
    told = {"profile": profile.model_dump(mode="json"), "samples": samples}
    Path(RESULTS, "sweep.json").write_text(json.dumps(told))
