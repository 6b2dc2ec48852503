from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from rig.database import Store
from rig.report import write_report
from rig.sweep.conclude import SweepResult
from tests.support.sweeps import SweepRecipe, stored_sweep


@dataclass(frozen=True)
class Reported:
    """A finished sweep and the text of its report."""

    store: Store
    result: SweepResult
    html: str


def report_of(folder_factory: pytest.TempPathFactory, recipe: SweepRecipe) -> Iterator[Reported]:
    store, result = stored_sweep(folder_factory.mktemp("sweep"), recipe)
    with store:
        path = write_report(store, result)
        yield Reported(store, result, path.read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reported]:
    """A sweep that passes its gates."""
    recipe = SweepRecipe(samples=3, holdout_every=3, note="<b>bold & loud</b>")
    yield from report_of(tmp_path_factory, recipe)


@pytest.fixture(scope="session")
def bad(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reported]:
    """A sweep that bends, warms, and does not find the board at one distance."""
    recipe = SweepRecipe(
        samples=2, holdout_every=3, bend_px=0.05, fails_at_mm=(640.0,), rise_degc=2.0
    )
    yield from report_of(tmp_path_factory, recipe)


@pytest.fixture(scope="session")
def least(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reported]:
    """The least that makes a curve: five stops, one sample, nothing held out, no way back."""
    recipe = SweepRecipe(
        distances_mm=(400.0, 550.0, 700.0, 920.0, 1200.0),
        samples=1,
        holdout_every=0,
        backward_every=0,
    )
    yield from report_of(tmp_path_factory, recipe)
