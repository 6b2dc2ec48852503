"""Searches run at the same time, and none holds up the answer of the others."""

import threading
import time
from collections.abc import Sequence

import pytest

from rig.cli.devices import as_dict
from rig.discovery import FoundDevice, Search, search_all
from rig.errors import ConfigError

FOUND = FoundDevice("/dev/video0", "a camera")


def finds(_timeout_s: float) -> Sequence[FoundDevice]:
    return [FOUND]


def lacks_an_extra(_timeout_s: float) -> Sequence[FoundDevice]:
    raise ConfigError("depthai is not installed", advice="pip install 'epirig[oak]'")


def test_what_is_found_and_what_is_missing_stand_side_by_side():
    oak, v4l2 = search_all([Search("oak", "a", lacks_an_extra), Search("v4l2", "b", finds)], 5.0)
    assert oak.devices == ()
    assert oak.note is not None
    assert "pip install" in oak.note
    assert v4l2.devices == (FOUND,)
    assert v4l2.note is None
    assert as_dict(v4l2)["devices"] == [
        {
            "name": "/dev/video0",
            "description": "a camera",
            "other_names": (),
            "problem": None,
            "layout": None,
            "picture": None,
        }
    ]


def test_a_search_that_hangs_is_left_behind():
    forever = threading.Event()

    def hangs(_timeout_s: float) -> Sequence[FoundDevice]:
        forever.wait()
        return []

    begun_s = time.monotonic()
    hung, good = search_all([Search("oak", "a", hangs), Search("v4l2", "b", finds)], 0.2)
    assert time.monotonic() - begun_s < 20.0
    forever.set()
    assert hung.note is not None
    assert "within 0.2 s" in hung.note
    assert good.devices == (FOUND,)


def test_searches_overlap():
    together = threading.Barrier(2, timeout=5.0)

    def meets(_timeout_s: float) -> Sequence[FoundDevice]:
        together.wait()
        return [FOUND]

    both = search_all([Search("oak", "a", meets), Search("v4l2", "b", meets)], 5.0)
    assert [findings.devices for findings in both] == [(FOUND,), (FOUND,)]


def test_a_mistake_of_ours_is_not_hidden():
    def breaks(_timeout_s: float) -> Sequence[FoundDevice]:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        search_all([Search("oak", "a", breaks)], 5.0)
