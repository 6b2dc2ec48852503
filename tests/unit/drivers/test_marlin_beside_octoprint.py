"""The Marlin driver against an emulator that others wrote: OctoPrint's virtual printer.

It runs in an environment of its own, because OctoPrint is AGPL and no dependency of this product:

    python3 -m venv ~/.cache/epirig/octoprint
    ~/.cache/epirig/octoprint/bin/pip install OctoPrint

RIG_OCTOPRINT_PYTHON names another Python that has it. Between the lines 100 and 115 the printer
asks for lines again, falls silent, and loses an answer, as it does by default.
"""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from rig_drivers.marlin.controller import marlin_stage

from rig.devices import SystemClock
from rig.errors import StageAlarmError
from rig.profile import MarlinStageConfig

BRIDGE = Path(__file__).resolve().parents[2] / "support" / "octoprint_bridge.py"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
PYTHON = Path(
    os.environ.get("RIG_OCTOPRINT_PYTHON", CACHE / "epirig" / "octoprint" / "bin" / "python")
)


@pytest.fixture
def port(tmp_path: Path) -> Iterator[str]:
    if not PYTHON.exists():
        pytest.skip(f"no OctoPrint: {PYTHON} does not exist, see the top of {Path(__file__).name}")
    with subprocess.Popen(
        [PYTHON, BRIDGE, tmp_path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        assert server.stderr is not None
        try:
            said = server.stdout.readline().strip()
            if not said:
                pytest.skip(f"no OctoPrint at {PYTHON}: {server.stderr.read().splitlines()[-1:]}")
            yield f"socket://127.0.0.1:{said}"
        finally:
            server.kill()


@pytest.mark.slow
def test_the_driver_gets_along_with_the_virtual_printer(port: str) -> None:
    config = MarlinStageConfig(
        kind="marlin",
        port=port,
        travel_mm=(400.0, 900.0),
        distance_at_machine_zero_mm=1000.0,
        direction=-1,
        speed_mm_s=100.0,
    )
    with marlin_stage(config, SystemClock()) as stage:
        assert stage.identity["version"] == "Virtual Marlin 1.0"
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm
        stage.home()
        assert stage.position_mm == pytest.approx(1000.0)
        places_mm = [800.0 + 5.0 * step for step in range(7)]
        for wanted_mm in places_mm:
            assert stage.move_to(wanted_mm, 20.0) == pytest.approx(wanted_mm)
        stage.stop()
        assert stage.position_mm == pytest.approx(places_mm[-1])
