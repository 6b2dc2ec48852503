"""What every test may ask for, and which tests stay together when several workers share them."""

import signal
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.support.command import Command


def pytest_configure() -> None:
    """Hear of a line that hangs up, which under `nohup` nobody does: tests of signals ask."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give tests that share fixtures to one worker, unless they name an `xdist_group` themselves.

    Those of one file share its fixtures; those of a folder with a `conftest.py`, the folder's.
    """
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            folder = item.path.parent
            shared = folder if (folder / "conftest.py").is_file() else item.path
            item.add_marker(pytest.mark.xdist_group(str(shared)))


_FIRST_STATES: dict[str, Any] = {}


@pytest.fixture(autouse=True)
def numbers_that_begin_anew(request: pytest.FixtureRequest) -> None:
    """The random numbers `RNG` of a file begin anew with each test, whichever ran before it."""
    module: ModuleType = request.module
    numbers = getattr(module, "RNG", None)
    if isinstance(numbers, np.random.Generator):
        bits = numbers.bit_generator
        bits.state = _FIRST_STATES.setdefault(module.__name__, bits.state)


@pytest.fixture
def rig(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Command:
    """The command line, with its database in a folder of this test."""
    monkeypatch.setenv("RIG_DATABASE", f"sqlite:///{tmp_path}/bench/rig.sqlite")
    return Command(capsys, monkeypatch)
