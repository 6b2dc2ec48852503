"""What every test may ask for."""

from pathlib import Path

import pytest

from tests.support.command import Command


@pytest.fixture
def rig(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Command:
    """The command line, with its database in a folder of this test."""
    monkeypatch.setenv("RIG_DATABASE", f"sqlite:///{tmp_path}/bench/rig.sqlite")
    return Command(capsys, monkeypatch)
