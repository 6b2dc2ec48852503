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
from typing import Any, Literal, cast

import pytest

from tests.hardware.vivid.guest import RESULTS, GuestUnavailableError, boot, guest_kernel

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
ON_HOST = "test_measured_on_host.py"
NEEDED_ON_HOST = "tests/hardware/vivid/test_sweep.py"
_GUEST_TIMEOUT_S = 1200.0
"""An idle machine needs two minutes; a busy one gets more."""

Outcome = dict[str, list[dict[str, object]]] | str
"""Reports by test, or why there is no guest."""
_outcome = pytest.StashKey[Outcome]()
_folder = pytest.StashKey[Path]()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The first test on the host takes as long as the guest lives."""
    for item in items:
        if not IS_GUEST and HERE in item.path.parents:
            item.add_marker(pytest.mark.timeout(_GUEST_TIMEOUT_S + 60.0))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """In the guest: hand every report over to the host."""
    if IS_GUEST:
        with Path(RESULTS, REPORTS).open("a") as file:
            file.write(json.dumps(report._to_json()) + "\n")


def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """On the host: report what the guest found instead of running the test here."""
    if IS_GUEST or not _belongs_to_guest(item):
        return None
    outcome = _outcome_of(item.session)
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in _reports(item, outcome):
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    # What a test on the host set up for this folder ends here, where pytest sees no test end.
    cast("Any", item.session)._setupstate.teardown_exact(nextitem)
    return True


@pytest.fixture
def guest_results(request: pytest.FixtureRequest) -> Path:
    """The folder that the guest wrote to, for tests of the host that go on with it."""
    outcome = _outcome_of(request.session)
    if isinstance(outcome, str):
        pytest.skip(f"no guest: {outcome}")
    return request.session.stash[_folder]


def _belongs_to_guest(item: pytest.Item) -> bool:
    return HERE in item.path.parents and item.path.name != ON_HOST


def _outcome_of(session: pytest.Session) -> Outcome:
    if _outcome not in session.stash:
        session.stash[_outcome] = run_in_guest(session, session.config)
    return session.stash[_outcome]


def run_in_guest(session: pytest.Session, config: pytest.Config) -> Outcome:
    """Boot the guest, and let it run all tests of this folder that were asked for."""
    tests = [_plain_id(item) for item in session.items if _belongs_to_guest(item)]
    if any(item.path.name == ON_HOST for item in session.items) and not any(
        test.startswith(NEEDED_ON_HOST) for test in tests
    ):
        tests.append(NEEDED_ON_HOST)
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "rig-tests")
    factory: pytest.TempPathFactory = cast("Any", config)._tmp_path_factory
    results = session.stash[_folder] = factory.mktemp("vivid")
    (results / "tests").write_text("\n".join(tests))
    from tests.hardware.vivid.render import render_all  # the guest has no use for it

    try:
        kernel = guest_kernel(cache, ["vivid"])
        render_all(results)
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
    reports: dict[str, list[dict[str, object]]] = {"": [{"console": console}]}
    file = results / REPORTS
    for line in file.read_text().splitlines() if file.is_file() else ():
        report = json.loads(line)
        reports.setdefault(report["nodeid"], []).append(report)
    return reports


def _script() -> str:
    pytest_call = [
        *(sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--basetemp=/run/tmp/pytest"),
        *("-q", "--timeout=150", "--durations=15", f"@{RESULTS}/tests"),
    ]
    return f"""
export RIG_VIVID_GUEST=1 PYTHONDONTWRITEBYTECODE=1 OPENBLAS_NUM_THREADS=1
export NUMBA_CACHE_DIR=/run/tmp/numba HYPOTHESIS_STORAGE_DIRECTORY=/run/tmp/hypothesis
cd {shlex.quote(str(ROOT))}
{shlex.join(pytest_call)}
cat /proc/uptime
"""


def _plain_id(item: pytest.Item) -> str:
    """Return the name of a test without the group that pytest-xdist may have put behind it."""
    return item.nodeid.partition("@")[0]


def _reports(item: pytest.Item, outcome: Outcome) -> list[pytest.TestReport]:
    if isinstance(outcome, dict) and (found := outcome.get(_plain_id(item))):
        return [pytest.TestReport._from_json({**told, "nodeid": item.nodeid}) for told in found]
    if isinstance(outcome, str):
        where = (str(item.path), (item.location[1] or 0) + 1, f"Skipped: no guest: {outcome}")
        return [_report(item, "skipped", where)]
    console = outcome[""][0]["console"]
    return [_report(item, "failed", f"the guest did not report on this test:\n{console}")]


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
