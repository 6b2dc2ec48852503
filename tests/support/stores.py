"""A store with a plan in it, and what is done with it in a process of its own."""

import itertools
import sys
from pathlib import Path

from rig.database import Store, open_store
from rig.plan import Stop
from tests.support.multiviews import noisy_multiview

STOPS = (
    Stop(0, 400.0, "fit", "forward"),
    Stop(1, 1234.5678, "holdout", "forward"),
    Stop(2, 400.0, "fit", "backward"),
)


def sqlite_url(folder: Path) -> str:
    """Return the address of a database in a folder; the frames will be beside it."""
    return f"sqlite:///{folder / 'rig.sqlite'}"


def new_sweep(store: Store, *, rig: str = "bench", samples_per_stop: int = 2) -> int:
    """Begin a sweep with the plan `STOPS`."""
    return store.create_sweep(
        rig=rig,
        profile={"name": rig, "pitch_mm": 0.1 + 0.2},
        stops=STOPS,
        samples_per_stop=samples_per_stop,
        versions={"rig": "1.0"},
        devices={"camera": {"serial": "A1"}},
    )


def new_calibration(store: Store, *, rig: str = "bench", active: bool = True) -> int:
    """Store a calibration whose content nobody reads."""
    return store.save_calibration(
        rig=rig,
        geometry={"version": 1, "scale": 0.1 + 0.2},
        quality={"reprojection_rms_px": 0.034},
        profile={"name": rig},
        versions={"rig": "1.0"},
        devices={"camera": {"serial": "A1"}},
        temperature_degc=31.25,
        image_size_px=(640, 400),
        active=active,
    )


def add_samples_forever(url: str, sweep_id: int) -> None:
    """Add samples to the first stop, until killed, and print the number of each."""
    with open_store(url) as store:
        for number in itertools.count():
            multiview = noisy_multiview(number)
            store.add_sample(sweep_id, stop=0, number=number, reached_mm=400.0, multiview=multiview)
            sys.stdout.write(f"{number}\n")
            sys.stdout.flush()
