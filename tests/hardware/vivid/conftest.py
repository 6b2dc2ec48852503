"""Tests of this folder run inside a guest that has the kernel's virtual cameras (`vivid`).

The host collects them as usual, boots one guest for all of them, lets pytest run there over the
same files, and reports what the guest reports. Where no guest can be built they are skipped, with
the reason.
"""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Literal, cast

import numpy as np
import pytest

from rig.frames import GreyImage
from tests.hardware.vivid.guest import GuestUnavailableError, boot, guest_kernel

IS_GUEST = "RIG_VIVID_GUEST" in os.environ
HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
CAMERAS = 5
VIVID = " ".join(
    [
        f"n_devs={CAMERAS}",
        "node_types=" + ",".join(["0x101"] * CAMERAS),  # one node to capture, one to feed
        "num_inputs=" + ",".join(["2"] * CAMERAS),
        "input_types=" + ",".join(["0xc"] * CAMERAS),  # 0: a webcam, 1: HDMI
        "num_outputs=" + ",".join(["1"] * CAMERAS),
        "output_types=" + ",".join(["1"] * CAMERAS),  # HDMI
    ]
)
REPORTS = "reports.jsonl"
PICTURES = "board.npy"
_GUEST_TIMEOUT_S = 280.0

_outcome = pytest.StashKey[dict[str, list[dict[str, object]]] | str]()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """In the guest: hand every report over to the host."""
    if IS_GUEST:
        with Path("/mnt", REPORTS).open("a") as file:
            file.write(json.dumps(report._to_json()) + "\n")


def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """On the host: report what the guest found instead of running the test here."""
    if IS_GUEST or HERE not in item.path.parents:
        return None
    outcome = item.session.stash.get(_outcome, None)
    if outcome is None:
        outcome = item.session.stash[_outcome] = run_in_guest(item.session, item.config)
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in _reports(item, outcome):
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def run_in_guest(
    session: pytest.Session, config: pytest.Config
) -> dict[str, list[dict[str, object]]] | str:
    """Return reports by test, or why there is no guest."""
    tests = [item.nodeid for item in session.items if HERE in item.path.parents]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "rig-tests")
    factory = pytest.TempPathFactory.from_config(config, _ispytest=True)
    results = factory.mktemp("vivid")
    (results / "tests").write_text("\n".join(tests))
    np.save(results / PICTURES, board_pictures())
    try:
        kernel = guest_kernel(cache, ["vivid"])
        console = boot(
            kernel,
            script=_script(),
            modules={"vivid": VIVID},
            results=results,
            memory_mb=2048,
            timeout_s=_GUEST_TIMEOUT_S,
        )
    except GuestUnavailableError as error:
        return str(error)
    except subprocess.TimeoutExpired as error:
        console = f"the guest did not end within {error.timeout:.0f} s"
    (results / "console").write_text(console)
    reports: dict[str, list[dict[str, object]]] = {"": [{"longrepr": console}]}
    file = results / REPORTS
    for line in file.read_text().splitlines() if file.is_file() else ():
        report = json.loads(line)
        reports.setdefault(report["nodeid"], []).append(report)
    return reports


def board_pictures() -> GreyImage:
    """Return what the simulated rig's reference view sees of its board at two places.

    Rendered on the host: the guest's arithmetic is emulated and slow.
    """
    from tests.support.cameras import SmallRig  # the guest has no use for it

    rig = SmallRig(("camera.width_px=640", "camera.height_px=480"))
    pictures: list[GreyImage] = []
    with rig.camera() as camera:
        for at_mm in (-603.0, -500.0):
            rig.slide.at_mm = at_mm
            pictures.append(camera.grab(1.0).frames[0].image)
    return cast("GreyImage", np.stack(pictures))


def _script() -> str:
    pytest_call = [
        *(sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--basetemp=/tmp/pytest"),
        *("-q", "--timeout=60", "--durations=15", "@/mnt/tests"),
    ]
    return f"""
export RIG_VIVID_GUEST=1 PYTHONDONTWRITEBYTECODE=1 OPENBLAS_NUM_THREADS=1
export NUMBA_CACHE_DIR=/tmp/numba HYPOTHESIS_STORAGE_DIRECTORY=/tmp/hypothesis
cd {shlex.quote(str(ROOT))}
{shlex.join(pytest_call)}
cat /proc/uptime
"""


def _reports(
    item: pytest.Item, outcome: dict[str, list[dict[str, object]]] | str
) -> list[pytest.TestReport]:
    if isinstance(outcome, dict) and item.nodeid in outcome:
        return [pytest.TestReport._from_json(report) for report in outcome[item.nodeid]]
    if isinstance(outcome, str):
        where = (str(item.path), (item.location[1] or 0) + 1, f"Skipped: no guest: {outcome}")
        return [_report(item, "skipped", where)]
    return [_report(item, "failed", f"the guest did not report:\n{outcome['']}")]


def _report(
    item: pytest.Item, outcome: Literal["failed", "skipped"], longrepr: str | tuple[str, int, str]
) -> pytest.TestReport:
    return pytest.TestReport(
        nodeid=item.nodeid,
        location=item.location,
        keywords=dict.fromkeys(item.keywords, 1),
        outcome=outcome,
        longrepr=longrepr,
        when="call",
    )
