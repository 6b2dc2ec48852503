"""What the library does to a whole process: output, signals, threads, memory, and its end."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]

OPEN_AND_CLOSE = """
import os, sys, threading
from tests.support.oak import OakRig

def state():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * 4096, len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))

rig = OakRig(("camera.rate_hz=100",))
states = []
for number in range(int(sys.argv[1])):
    with rig.camera() as camera:
        camera.grab(10.0)
    states.append(state())
print(*states[19], *states[-1])  # the allocator settles during the first openings
"""

DIES = """
import signal, sys
from tests.support.oak import OakRig
from rig_sim.oak import SensorFaults

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have switched it off

how = sys.argv[1]
fault = SensorFaults(raises_after=3) if how == "node" else SensorFaults()
camera = OakRig((), {"left": fault}).camera()
if how == "left open":
    camera.__enter__().grab(10.0)
    sys.exit(7)
with camera:
    camera.grab(10.0)
    if how == "exit":
        sys.exit(7)
    while True:
        camera.grab(10.0)
"""

FLOOD = """
import faulthandler, time
import numpy as np
from rig_drivers.oak.host_sensors import HostSensors
from rig_drivers.oak.streams import Streams
from rig_sim.oak import SimSensorFrame

faulthandler.dump_traceback_later(40, exit=True)

class Flood:
    serial = "flood"
    factory_calibration = None

    def sources(self):
        return {view: Flood() for view in "abc"}
    count = 0
    def next_frame(self, wait_s):
        self.count += 1
        if self.count % 4 == 0:
            time.sleep(0)
        now_s = time.monotonic()
        image = np.zeros((4, 8), np.uint8)
        return SimSensorFrame(image, now_s, self.count, 0.001, 100, -1, 0, None)

with HostSensors(Flood()) as sensors, Streams(sensors, period_s=0.001) as streams:
    ends_s = time.monotonic() + 4.0
    while time.monotonic() < ends_s:
        streams.next_group(0.0)
print(streams.watchdog.silent_since(ends_s - 3.0))
"""


def run(code: str, *arguments: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.slow
def test_importing_leaves_standard_output_signals_and_telemetry_alone():
    code = (
        "import os, signal\n"
        "before = [signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGSEGV)]\n"
        "from rig_drivers.oak.sdk import dai\n"
        "dai.Pipeline(createImplicitDevice=False)\n"
        "assert [signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGSEGV)]"
        " == before\n"
        "ignored = [l for l in open('/proc/self/status') if l.startswith('SigCgt')]\n"
        "caught = int(ignored[0].split()[1], 16)\n"
        "assert not caught & (1 << (signal.SIGSEGV - 1)), 'a handler for crashes is installed'\n"
        "print(os.environ['DEPTHAI_TELEMETRY'])\n"
    )
    ended = run(code)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == "0\n"
    assert run(code, DEPTHAI_TELEMETRY="1").stdout == "1\n"  # what the user has set stays


@pytest.mark.slow
def test_fifty_openings_leak_nothing_and_the_process_ends_well():
    ended = run(OPEN_AND_CLOSE, "50")
    assert ended.returncode == 0, ended.stderr
    memory, threads, files, memory_after, threads_after, files_after = map(
        int, ended.stdout.split()
    )
    assert threads_after == threads
    assert files_after == files
    assert memory_after - memory < 2_000_000


@pytest.mark.slow
@pytest.mark.parametrize("how", ["exit", "left open"])
def test_a_process_that_ends_with_a_camera_open_ends_with_its_own_code(how: str):
    ended = run(DIES, how)
    assert ended.returncode == 7, ended.stderr


@pytest.mark.slow
def test_an_exception_inside_a_node_ends_in_our_error():
    ended = run(DIES, "node")
    assert ended.returncode == 1
    assert "DeviceLostError" in ended.stderr
    assert "the sensor of view left failed: RuntimeError" in ended.stderr


@pytest.mark.slow
def test_frames_as_fast_as_they_can_be_sent_never_lock_reader_and_senders():
    """One reading that keeps the interpreter's lock is enough to hang this within a second."""
    ended = run(FLOOD)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == "()\n"


@pytest.mark.slow
def test_ctrl_c_while_frames_flow_ends_as_an_interruption():
    process = subprocess.Popen(
        [sys.executable, "-c", DIES.replace("camera.grab(10.0)", "print(flush=True)"), "interrupt"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert "KeyboardInterrupt" in err
    assert process.returncode == -signal.SIGINT
