"""A small store as operators find it: one sweep concluded, one still to be concluded."""

import atexit
import functools
import shutil
import tempfile
from pathlib import Path

from rig.database import Store, open_store
from rig.database.store import store_at
from rig.file_modes import FileModes
from tests.support.multiviews import noisy_multiview
from tests.support.stores import STOPS, new_calibration, new_sweep, sqlite_url

SAMPLES = len(STOPS)
"""Of each sweep: one at every stop."""
FILES = 3 * SAMPLES
"""Images of each sweep."""
CONCLUDED, TAKEN = 1, 2
"""Numbers of the sweeps."""


def filled(store: Store) -> None:
    """Put two sweeps and a calibration into a store."""
    new_calibration(store)
    for sweep_id in (CONCLUDED, TAKEN):
        new_sweep(store, samples_per_stop=1)
        for stop in STOPS:
            picture = noisy_multiview(10 * sweep_id + stop.index)
            store.add_sample(sweep_id, stop=stop.index, number=0, reached_mm=1.0, multiview=picture)
    store.save_curve(CONCLUDED, curve={"a": 0.1 + 0.2}, holdout={"rms_pct": 0.5}, versions={})


@functools.cache
def _made() -> Path:
    """Return a folder with such a store: to make one takes ten times as long as to copy it."""
    folder = Path(tempfile.mkdtemp(prefix="rig-store-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    with store_at(folder / "rig.sqlite", folder / "frames", FileModes()) as store:
        filled(store)
    return folder


def kept_store(folder: Path) -> Store:
    """Return an open store in a folder, with two sweeps in it."""
    shutil.copytree(_made(), folder, dirs_exist_ok=True)
    return open_store(sqlite_url(folder))


def sample_place(store: Store, sweep_id: int, at: int = 0) -> Path:
    """Return the folder of a sample."""
    return store.samples(sweep_id)[at].folder
