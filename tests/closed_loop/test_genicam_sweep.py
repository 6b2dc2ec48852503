"""A whole sweep over GenICam cameras: rendered boards go through GigE Vision, Aravis and rig."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from rig.database import open_store
from rig.hardware.opening import open_hardware
from rig.profile import Profile
from rig.profile.load import parse_profile
from rig.sweep.job import new_sweep
from rig.sweep.request import SweepRequest
from rig.sweep.sweep import sweep_and_conclude
from tests.support.cameras import SmallRig
from tests.support.gige.camera import GigeCamera
from tests.support.gige.library import aravis_library
from tests.support.small_sim import SMALL_PAIR
from tests.support.stores import sqlite_url

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("gige")]

ADDRESSES = {"centre": "127.0.0.61", "right": "127.0.0.62"}
ZERO_MM = 1203.0
DISTANCES_MM = (400.0, 470.0, 560.0, 700.0, 850.0, 1000.0)


class Carrier:
    """A person at a page who puts the board where it is asked for, and says so."""

    def __init__(self, rig: SmallRig) -> None:
        self._rig = rig
        self._wanted_mm = 0.0
        self.pictures: dict[str, bytes] = {}

    def ask(self, text: str) -> None:
        self._wanted_mm = float(text.split(" mm", maxsplit=1)[0].rsplit(" ", 1)[1])

    def settle(self) -> None:
        """Nothing is shown."""

    def answer(self, timeout_s: float) -> str | None:
        self._rig.slide.at_mm = self._wanted_mm - ZERO_MM
        with self._rig.camera() as camera:
            shown = camera.grab(timeout_s + 1.0)
        self.pictures = {f.view: np.asarray(f.image, np.uint8).tobytes() for f in shown.frames}
        return ""

    def painter(self, view: str) -> Callable[[], bytes]:
        """What a camera sees: nothing before a board was put anywhere."""
        return lambda: self.pictures.get(view, bytes(320 * 200))


def plugged_in(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the package be found as pip would have installed it."""
    about = folder / "rig_genicam-0.1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: rig-genicam\nVersion: 0.1.0\n")
    (about / "entry_points.txt").write_text("[rig.cameras]\ngenicam = rig_genicam.kind:GENICAM\n")
    monkeypatch.syspath_prepend(str(folder))


def with_genicam(simulated: Profile) -> Profile:
    data = simulated.model_dump(mode="json", exclude_unset=True)
    data["world"] = None
    data["stage"] = {"kind": "manual", "travel_mm": [400.0, 1200.0]}
    data["camera"] = {
        **{"kind": "genicam", "devices": ADDRESSES, "width_px": 320, "height_px": 200},
        **{"rate_hz": 10.0, "exposure_s": 0.008, "max_skew_s": 0.02, "timeout_s": 20.0},
        "trigger": {"source": "Software"},
    }
    return parse_profile(data, source="genicam")


def test_a_sweep_by_software_triggers_finds_the_focus_distance(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    aravis_library()
    plugged_in(tmp_path, monkeypatch)
    rig = SmallRig((*SMALL_PAIR, "sweep.backward_every=0"))
    carrier = Carrier(rig)
    profile = with_genicam(rig.profile)
    with ExitStack() as stack:
        for view, address in ADDRESSES.items():
            device = GigeCamera(address, serial=view, paint=carrier.painter(view))
            stack.enter_context(device)
        store = stack.enter_context(open_store(sqlite_url(tmp_path)))
        job = new_sweep(store, profile, SweepRequest(at_mm=DISTANCES_MM, samples=1))
        hardware = stack.enter_context(open_hardware(profile, carrier))
        result = sweep_and_conclude(job, hardware, store, lambda *_: None, lambda _: None)
        kept = store.sweep(result.sweep_id)
    assert result.fit.best.focus_mm == pytest.approx(700.0, abs=1.0)
    assert result.fit.holdout is not None
    assert result.fit.holdout.rms_mm < 1.0
    assert "Rig Wire" in str(kept)
