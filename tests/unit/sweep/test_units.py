"""A sweep belongs to one unit from its first sample to its last."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.database import open_store
from rig.devices import Camera
from rig.errors import ConfigError, CurveError, StoreError
from rig.hardware.opening import Hardware, open_hardware
from rig.profile.load import load_profile
from rig.sweep.job import new_sweep, owned_to_resume
from rig.sweep.measure_again import measure_again
from rig.sweep.request import SweepRequest
from rig.sweep.sweep import sweep_and_conclude
from tests.support.multiviews import noisy_multiview
from tests.support.small_sim import SMALL_SIM
from tests.support.stores import new_sweep as begun
from tests.support.stores import sqlite_url

PLAN = SweepRequest(None, None, None, (400.0, 500.0, 650.0), 1)


def stopped_after_one(count: int, _: str) -> None:
    if count == 1:
        raise KeyboardInterrupt


def unit(name: str):
    return load_profile("sim", (*SMALL_SIM, f"unit={name}", "sweep.holdout_every=0"))


@pytest.mark.slow
def test_a_sweep_keeps_its_unit_and_who_took_it_and_another_unit_does_not_go_on(tmp_path: Path):
    first, second = unit("A1"), unit("B2")
    with open_store(sqlite_url(tmp_path)) as store:
        job = replace(new_sweep(store, first, PLAN), note="cold", tags=("night",))
        with open_hardware(first) as hardware, pytest.raises(KeyboardInterrupt):
            sweep_and_conclude(job, hardware, store, stopped_after_one, lambda _: None)
        sweep = store.sweep(1)
        assert (sweep.unit, sweep.note, sweep.provenance.tags) == ("A1", "cold", ("night",))
        assert sweep.provenance.command != ""
        taken = store.samples(1)
        with (
            owned_to_resume(store, second, 1) as again,
            open_hardware(second) as hardware,
            pytest.raises(
                ConfigError, match="resume sweep 1 of unit A1 of rig sim, this one is B2"
            ),
        ):
            sweep_and_conclude(again, hardware, store, lambda *_: None, lambda _: None)
        assert store.samples(1) == taken


class Serial:
    """A camera that says that it is another one."""

    def __init__(self, camera: Camera, serial: str) -> None:
        self._camera = camera
        self.identity = {**camera.identity, "serial": serial}

    def __getattr__(self, name: str) -> object:
        return getattr(self._camera, name)


def test_a_calibration_of_another_unit_begins_no_sweep(tmp_path: Path):
    profile = unit("B2")
    with open_store(sqlite_url(tmp_path)) as store:
        job = new_sweep(store, profile, PLAN)
        job = replace(job, run=replace(job.run, by_itself=(("calibration 3", "A1"),)))
        with (
            open_hardware(profile) as hardware,
            pytest.raises(CurveError, match="calibration 3 of rig sim is of unit A1, this one is"),
        ):
            other: Camera = Serial(hardware.camera, "B2")  # pyright: ignore[reportAssignmentType]
            opened = Hardware(other, hardware.stage, hardware.clock)
            sweep_and_conclude(job, opened, store, lambda *_: None, lambda _: None)
        assert store.sweeps() == ()


def test_what_was_pruned_is_not_fitted_again(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        number = begun(store)
        store.add_sample(number, stop=0, number=0, reached_mm=1.0, multiview=noisy_multiview(0))
        with store.owned_sweep(number, "asked"):
            store.mark_pruned(number)
        with pytest.raises(
            StoreError, match="asked to fit sweep 1, the frames of 1 of its 1 samples were pruned"
        ):
            measure_again(store, number, lambda *_: None)
