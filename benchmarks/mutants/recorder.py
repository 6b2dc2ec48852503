"""A pytest plug-in that notes which test runs which line, and how long each test takes.

A test that fails is left out: it would notice every fault.

Not the plug-in of coverage itself: it must be known whether a line ran in a test or in the set-up
of a fixture, which belongs to every test of the file.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import coverage
import pytest

FOLDER = "RIG_MUTANTS_RECORD"
"""The variable that names the folder for what is recorded."""
LINES = "lines"
"""Name of the file that says which test ran which line; of a worker's, the beginning."""
SETUP = "|setup"
"""Stands behind the name of a test whose set-up ran the line."""


class Recorder:
    """Switches the context of the coverage run with every phase of every test."""

    def __init__(self, folder: Path, worker: str) -> None:
        self._durations_s: dict[str, float] = {}
        self._failed: set[str] = set()
        self._folder = folder
        self._worker = worker
        self._coverage = coverage.Coverage(
            data_file=str(folder / LINES),
            data_suffix=worker,
            source=["rig", "rig_drivers", "rig_sim"],
            config_file=False,
        )
        # Names relative to the tree, so that a record is of use to another copy of it.
        self._coverage.set_option("run:relative_files", True)

    def pytest_sessionstart(self) -> None:
        """Begin to record."""
        self._coverage.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Iterator[None]:
        """What a fixture runs is noted apart from what the test runs."""
        self._coverage.switch_context(plain(item.nodeid) + SETUP)
        return (yield)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """See above."""
        self._coverage.switch_context(plain(item.nodeid))
        return (yield)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up the phases of a test."""
        name = plain(report.nodeid)
        if report.failed:
            self._failed.add(name)
        self._durations_s[name] = self._durations_s.get(name, 0.0) + report.duration

    def pytest_sessionfinish(self) -> None:
        """Write both."""
        self._coverage.stop()
        self._coverage.save()
        file = self._folder / f"durations.{self._worker}.json"
        passed = {t: took_s for t, took_s in self._durations_s.items() if t not in self._failed}
        file.write_text(json.dumps(passed))


def plain(nodeid: str) -> str:
    """Return a test's name without the group that pytest-xdist puts behind it.

    A name with parameters, which may hold any character, ends with a bracket; a group does not.
    """
    name, _, group = nodeid.rpartition("@")
    return name if name and not group.endswith("]") else nodeid


def pytest_configure(config: pytest.Config) -> None:
    """Record in every process that runs tests, not in the one that deals them out."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker or not config.getoption("numprocesses", default=None):
        config.pluginmanager.register(Recorder(Path(os.environ[FOLDER]), worker or "alone"))
