"""Looks beside a capture: now and then, one at a time, and an alarm is told once."""

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.capture.drift_log import DriftLog
from rig.capture.drift_watch import ALARM, DriftWatch, SceneLook, look_of
from rig.check.scene_drift import Seen
from rig.database import open_store
from rig.errors import CalibrationError
from rig.frames import Frame, MultiView
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.optics.nominal import nominal_optics
from rig.profile.load import load_profile
from rig.stored import Run
from tests.support.scene_pictures import cards, geometry_of, photographs, true_camera
from tests.support.stores import new_calibration, sqlite_url
from tests.unit.capture.scripted import one_frame

PAIR = load_profile("checkerboard-stereo")


class Watched:
    """A watch, the time that it is told, and what it looked at."""

    def __init__(self, look: Callable[[Seen], str | None]) -> None:
        self.now_s = 100.0
        self.said: list[str] = []
        self.watch = DriftWatch(look, self.said.append, now_s=lambda: self.now_s)

    def offer(self, at_s: float) -> tuple[str, ...]:
        """Offer the one frame; return its warnings."""
        self.now_s = at_s
        return self.watch.watched(one_frame()).slopes.warnings


def test_the_first_look_is_after_ten_seconds_the_next_after_thirty_more():
    seen: list[float] = []
    watched = Watched(lambda _: seen.append(watched.now_s))
    for at_s in (100.0, 109.9, 110.0, 139.9, 140.0):
        with watched.watch:
            watched.offer(at_s)
    assert seen == [110.0, 140.0]


def test_one_look_at_a_time():
    go, looks = threading.Event(), []

    def look(_: Seen) -> None:
        looks.append(go.wait(10.0))

    watched = Watched(look)
    watched.offer(110.0)
    watched.offer(200.0)
    go.set()
    with watched.watch:
        pass
    assert looks == [True]


def test_after_an_alarm_frames_are_warned_of_and_it_looks_no_more():
    looks: list[Seen] = []

    def look(seen: Seen) -> str:
        looks.append(seen)
        return "right has turned"

    watched, warned = Watched(look), list[tuple[str, ...]]()
    for at_s in (109.0, 110.0, 150.0, 190.0):
        with watched.watch:
            warned.append(watched.offer(at_s)[len(one_frame().slopes.warnings) :])
    assert [seen.views for seen in looks] == [one_frame().views]
    assert [seen.earlier for seen in looks] == [one_frame().views]
    assert watched.said == ["right has turned"]
    assert warned[0] == ()
    assert warned[2:] == [("right has turned",)] * 2


def test_a_look_that_is_not_possible_is_told_once_and_it_goes_on():
    looks: list[int] = []

    def look(_: Seen) -> str:
        looks.append(1)
        raise CalibrationError("right shares 3 features", advice="show texture")

    watched = Watched(look)
    for at_s in (110.0, 150.0):
        with watched.watch:
            watched.offer(at_s)
    assert len(looks) == 2
    assert watched.said == [
        "whether views have turned is not told: right shares 3 features; show texture"
    ]


def test_without_a_calibration_nothing_is_looked_at(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        assert look_of(Run(PAIR, nominal_optics(PAIR)), store, "", DriftLog()) is None
        geometry = geometry_of([true_camera(v.name, (0.0, 0.0, 0.0)) for v in PAIR.views])
        stored = replace(
            store.calibration(new_calibration(store)), geometry=geometry_to_json(geometry)
        )
        run = Run(PAIR, nominal_optics(PAIR), calibration=stored)
        assert isinstance(look_of(run, store, "7", DriftLog()), SceneLook)
        lenslets = replace(stored, geometry={"lenslets": {}})
        assert look_of(replace(run, calibration=lenslets), store, "", DriftLog()) is None


def test_earlier_looks_are_read_only_where_they_are_shown(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        geometry = geometry_of([true_camera(v.name, (0.0, 0.0, 0.0)) for v in PAIR.views])
        stored = replace(
            store.calibration(new_calibration(store)), geometry=geometry_to_json(geometry)
        )
        run = Run(PAIR, nominal_optics(PAIR), calibration=stored)
        kept = store.save_drift(stored.id, rig=stored.rig, details={}, temperature_degc=None)
        hidden, shown = DriftLog(), DriftLog()
        shown.show()
        for log in (hidden, shown):
            look_of(run, store, "", log)
        hidden.add(kept)
    assert hidden.series is None
    assert shown.series is not None
    assert shown.series.looks == (kept,)


@pytest.mark.slow
def test_a_view_that_turned_is_told_and_every_look_is_kept(tmp_path: Path):
    names = [view.name for view in PAIR.views]
    straight = [true_camera(n, (75.0 * k, 0.0, 0.0)) for k, n in enumerate(names)]
    rig = geometry_of(straight)
    sure = np.diag(np.array([*8 * [1e-3], *3 * [1e-6], *3 * [1e-3]]) ** 2)
    turned = [straight[0], replace(straight[1], rotation_deg=(0.2, 0.0, 0.0))]
    with open_store(sqlite_url(tmp_path)) as store:
        stored = replace(
            store.calibration(new_calibration(store)),
            geometry=geometry_to_json(replace(rig, covariance=sure)),
        )
        look = SceneLook(PAIR, stored, store, "7")
        said = [
            look(
                Seen(
                    MultiView(
                        tuple(
                            Frame(name, image, 1.0, 1)
                            for name, image in zip(
                                names, photographs(cameras, cards(4), 5), strict=True
                            )
                        ),
                        33.5,
                    )
                )
            )
            for cameras in (straight, turned)
        ]
        kept = store.drifts()
    assert said[0] is None
    assert said[1] is not None
    assert f"{names[1]} has turned 0.2" in said[1]
    assert [look.temperature_degc for look in kept] == [33.5, 33.5]
    assert [look.unit for look in kept] == ["7", "7"]
    chances = [look.details["probability"] for look in kept]
    assert isinstance(chances[1], float)
    assert chances[1] < ALARM
