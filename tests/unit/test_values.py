"""Mathematics and values load no database, whatever is imported first."""

import subprocess
import sys

import pytest

PURE = (
    "rig.geometry",
    "rig.targets",
    "rig.epipolar",
    "rig.curve",
    "rig.depth",
    "rig.optics",
    "rig.records",
    "rig.measurement",
    "rig.frames",
    "rig.plan",
    "rig.sweep.measure_sample",
    "rig.sweep.measuring_thread",
    "rig.sweep.points",
    "rig.report.scatter",
    "rig.compare.distances",
    "rig.check.geometry_drift",
    "rig.live.measure",
    "rig.live.camera",
)
"""Modules, and packages with all that is in them."""

# One interpreter for all: what none of them brings in, each alone does not either.
PROGRAM = """
import importlib, pkgutil, sys
for name in sys.argv[1:]:
    module = importlib.import_module(name)
    below = pkgutil.walk_packages(getattr(module, "__path__", ()), f"{name}.")
    for inner in (name, *(found.name for found in below)):
        importlib.import_module(inner)
        loaded = {"sqlalchemy", "alembic", "rig.database"} & set(sys.modules)
        if loaded:
            sys.exit(f"{inner} brings in {', '.join(sorted(loaded))}")
print("none of them")
"""


def imported(*names: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", PROGRAM, *names]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_no_mathematics_and_no_value_loads_the_database():
    done = imported(*PURE)
    assert (done.stdout, done.stderr, done.returncode) == ("none of them\n", "", 0)


def test_what_does_load_it_is_noticed():
    done = imported("rig.plan", "rig.database.location")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("rig.database.location brings in ")
